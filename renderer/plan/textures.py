"""Textures as they are built for a plan."""

from renderer.assets import AssetError
from renderer.errors import SceneError
from renderer.plan.effects import TEXTURES
from renderer.plan.request import Request
from renderer.textures import Texture
from renderer.textures.heights import Heights
from renderer.textures.image import ImageTexture
from renderer.textures.mipmap import MipmapTexture
from schemas.pointers import escaped
from schemas.problems import Problem


def texture_of(request: Request, name: str, *, stored: bool) -> Texture:
    """A texture of the scene; `stored` for data, which is read as the file holds it.

    Raises
    ------
    SceneError
        If its file is missing or no picture.
    """
    texture = request.document.textures[name]
    if stored:
        texture = texture.model_copy(update={"encoding": "linear"})
    try:
        return TEXTURES[type(texture)](texture, request.scene.assets)
    except AssetError as error:
        pointer = f"/textures/{escaped(name)}/asset"
        raise SceneError((Problem(pointer=pointer, detail=str(error), code="asset"),)) from error


def heights_of(request: Request, name: str, scale: float) -> Heights:
    """A texture of the scene as heights."""
    texture = texture_of(request, name, stored=True)
    if isinstance(texture, MipmapTexture):
        texture = texture.levels[0]
    assert isinstance(texture, ImageTexture)
    return Heights(texture, scale)
