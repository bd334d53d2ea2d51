"""What is to be compiled, and the plan in the making."""

from dataclasses import dataclass, field

import numpy as np

from renderer.scenes import LoadedScene
from renderer.stages import Listing
from schemas.quality import Quality, TargetQuality
from schemas.sampling import Antialiasing, LightSampling, Sampling
from schemas.scene import Scene


@dataclass(slots=True)
class Request:
    """A scene, how it shall be sampled, and what follows from both.

    Attributes
    ----------
    scene : LoadedScene
    quality : Quality or None
    culling : bool
        Whether conservative tests may leave out work.
    layers : tuple of str
        Names of what shall be told about each pixel beside its colour.
    listing : Listing
        The plan as told to people.
    sampling : Sampling
        The scene's own, or what `quality` puts in its place.
    dtype : float32 or float64
        Of pair work.
    names : list of str
        Materials that some shape shows, in the order of the scene.
    rays : float
        Camera rays, for prices.
    degenerate : int
        Triangles without area among the scene's shapes.
    retried : int
        Triangles so thin that exact arithmetic had to tell if they have an area.
    """

    scene: LoadedScene
    quality: Quality | None
    culling: bool
    layers: tuple[str, ...] = ()
    listing: Listing = field(default_factory=Listing)
    sampling: Sampling = field(init=False)
    dtype: np.dtype[np.floating] = field(init=False)
    names: list[str] = field(init=False)
    rays: float = field(init=False)
    degenerate: int = 0
    retried: int = 0

    def __post_init__(self) -> None:
        """Work out what follows."""
        self.sampling = _sampling(self.document.sampling, self.quality)
        double = self.quality is not None and self.quality.precision == "double"
        self.dtype = np.dtype(np.float64 if double else np.float32)
        shown = {shape.material for shape in self.document.shapes}
        self.names = [name for name in self.document.materials if name in shown]
        camera = self.document.camera
        self.rays = float(camera.width * camera.height * self.sampling.antialiasing.samples)

    @property
    def target(self) -> TargetQuality | None:
        """The error asked for, if it is one."""
        return self.quality if isinstance(self.quality, TargetQuality) else None

    @property
    def document(self) -> Scene:
        """The scene as written."""
        return self.scene.document


ADAPTIVE = {
    "antialiasing": Antialiasing(pattern="sobol", samples=16),
    "light": LightSampling(pattern="sobol", samples=4),
}
"""Target quality takes camera samples where they are needed, with so few light points each that they cost no
more than the ray. How many there will be is
not known; their price is that of so many."""


def _sampling(sampling: Sampling, quality: Quality | None) -> Sampling:
    if quality is None:
        return sampling
    if isinstance(quality, TargetQuality):
        return sampling.model_copy(update=ADAPTIVE)
    changes = {"antialiasing": quality.antialiasing, "light": quality.light}
    return sampling.model_copy(update={part: value for part, value in changes.items() if value is not None})
