"""Textures as they are built for plans: each of a scene once, when it is first asked for."""

from renderer.assets import AssetError, AssetSource
from renderer.errors import SceneError
from renderer.plan.effects import TEXTURES
from renderer.textures import Texture
from renderer.textures.heights import Heights
from schemas.pointers import escaped
from schemas.problems import Problem
from schemas.scene import Scene
from schemas.textures import Texture as Written


class Textures:
    """The textures that have been built from a scene's files, by what the scene says of them."""

    def __init__(self, assets: AssetSource) -> None:
        self._assets = assets
        self._built: dict[Written, Texture] = {}

    def named(self, document: Scene, name: str, *, stored: bool) -> Texture:
        """A texture of a scene; `stored` for data, which is read as the file holds it.

        Raises
        ------
        SceneError
            If its file is missing or no picture.
        """
        written = document.textures[name]
        if stored:
            written = written.model_copy(update={"encoding": "linear"})
        try:
            return self._of(written)
        except AssetError as error:
            pointer = f"/textures/{escaped(name)}/asset"
            raise SceneError((Problem(pointer=pointer, detail=str(error), code="asset"),)) from error

    def _of(self, written: Written) -> Texture:
        """Two threads may build the same texture; both get one of them in the end."""
        if written not in self._built:
            self._built.setdefault(written, TEXTURES[type(written)].build(written, self._assets))
        return self._built[written]

    def heights(self, document: Scene, name: str, scale: float) -> Heights:
        """A texture of a scene as heights; raises as `named` does."""
        effect = TEXTURES[type(document.textures[name])]
        assert effect.heights is not None, "the scene language takes heights of images alone"
        return Heights(effect.heights(self.named(document, name, stored=True)), scale)
