"""Compilation input, and the plan under construction."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from renderer.plan.geometry import SceneGeometry, shown_materials
from renderer.plan.stages import Entry
from renderer.plan.strengths import effective, without_strength
from renderer.scenes import LoadedScene
from renderer.shapes import Family
from renderer.textures import Texture
from renderer.textures.heights import Heights
from schemas.api.plans import LeftOut
from schemas.materials import Material
from schemas.pointers import escaped
from schemas.quality import FixedQuality, Quality, Sampling
from schemas.scene import Scene


@dataclass(slots=True)
class Request:
    """A scene with its sampling, and everything derived from both.

    Attributes
    ----------
    scene : LoadedScene
    quality : Quality or None
    geometry : SceneGeometry
        Of the scene; plans of other qualities share it.
    culling : bool
        Whether conservative tests may leave out work.
    layers : tuple of str
        Names of the values to record of each pixel besides its colour.
    entries, left_out : list
        The plan as people read it, under construction.
    reads : set of str
        Optional fields of `interaction.Points` that stages read.
    document : Scene
        The scene without parts of strength 0.
    sampling : Sampling
        The scene's own, or that of `quality`.
    dtype : float32 or float64
        Of pair work.
    names : list of str
        Materials that some shape shows, in the order of the scene.
    rays : float
        Camera rays, for prices.
    crowds : dict
        Of each kind of shapes, those that a camera ray may hit beyond the few that its price allows for.
    """

    scene: LoadedScene
    quality: Quality | None
    geometry: SceneGeometry
    culling: bool
    layers: tuple[str, ...] = ()
    entries: list[Entry] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    reads: set[str] = field(default_factory=set)
    crowds: dict[str, float] = field(default_factory=dict)
    document: Scene = field(init=False)
    sampling: Sampling = field(init=False)
    dtype: np.dtype[np.floating] = field(init=False)
    names: list[str] = field(init=False)
    rays: float = field(init=False)

    def __post_init__(self) -> None:
        """Work out what follows."""
        self.document = effective(self.scene.document)
        self.sampling = _sampling(self.document, self.quality)
        double = self.quality is not None and self.quality.precision == "double"
        self.dtype = np.dtype(np.float64 if double else np.float32)
        self.names = shown_materials(self.document)
        self.left_out.extend(without_strength(self.scene.document, self.names))
        width, height = self.document.camera.picture_size
        self.rays = float(width * height * self.sampling.antialiasing.samples)

    def list_stage(
        self, name: str, effect: str, detail: str, pointers: tuple[str, ...] = (), each: float = 0.0
    ) -> None:
        """List a stage that is expected to cost `each` nanoseconds a camera ray."""
        self.entries.append(Entry(name, effect, detail, pointers, self.rays * each * 1e-9))

    def material_pointers(self, chosen: Iterable[int], part: str = "") -> tuple[str, ...]:
        """Pointers to shown materials by their numbers, or to a part of each that begins with ``/``."""
        return tuple(f"/materials/{escaped(self.names[number])}{part}" for number in chosen)

    def leave_out(self, effect: str, reason: str, *pointers: str) -> None:
        """List a part of the scene that does not run."""
        self.left_out.append(LeftOut(effect=effect, pointers=pointers, reason=reason))

    @property
    def materials(self) -> list[Material]:
        """The materials of `names`."""
        return [self.document.materials[name] for name in self.names]

    def kinds(self) -> dict[str, list[int]]:
        """Numbers of shown materials by their `type`."""
        found: dict[str, list[int]] = {}
        for number, material in enumerate(self.materials):
            found.setdefault(material.type, []).append(number)
        return found

    @property
    def families(self) -> tuple[Family, ...]:
        """The scene's shapes."""
        return self.geometry.families

    def texture(self, name: str, *, stored: bool) -> Texture:
        """A texture of the scene, as `Textures.named` gives it."""
        return self.geometry.textures.named(self.document, name, stored=stored)

    def heights(self, name: str, scale: float) -> Heights:
        """A texture of the scene as heights."""
        return self.geometry.textures.heights(self.document, name, scale)


def _sampling(document: Scene, quality: Quality | None) -> Sampling:
    if not isinstance(quality, FixedQuality):
        return document.sampling
    changes = {"antialiasing": quality.antialiasing, "light": quality.light}
    return document.sampling.model_copy(
        update={part: value for part, value in changes.items() if value is not None}
    )
