"""CPU seconds of target quality, from pictures of reduced size.

What target quality does somewhere depends on the whole picture, so blocks of it tell nothing. A small
picture is rendered in the same way, then a larger one, as long as there is time for it; where that suffices
for the whole picture, its cost is known.
"""

import time
from dataclasses import dataclass, field
from math import ceil, log, sqrt

from renderer.adaptive.rendering import render_adaptively
from renderer.quotes.deadlines import Deadline
from renderer.quotes.ranges import Range, factor
from renderer.quotes.settings import compiled, target
from renderer.quotes.timings import UNSTEADY
from renderer.results import TileEvent
from renderer.scenes import LoadedScene
from schemas.cameras import Camera
from schemas.quality import CONFIDENCE

SMALLEST = 64
"""The longer side of the first picture, pixels. Smaller ones show edges and nothing else."""

LEAST = 16
"""Its longer side where time is short: it tells little, but all else would tell nothing."""

STEP = 2.0
"""By which sides grow at least from one picture to the next: a smaller step tells nothing new."""

POWER = 0.4
"""Power of the number of pixels like which seconds grow: few of the new pixels of a larger picture lie on
edges, and small ones are calls more than rays. What two small pictures say of it is mostly chance."""

UNSURE = 0.4
"""Standard deviation of the logarithm of the CPU time, for a picture of four times the pixels; for other
sizes it goes with the root of the logarithm of the factor. Both are those of the gallery at errors of one to
four steps of 8 bits, see `python -m benchmarks quotes`."""

SPARE = 1.3
"""Times the predicted seconds that have to be left for the next picture."""

FIRST = 0.05
"""Share of the time left that the rays of a first picture may take: with the calls it takes many times that,
and one that is given up tells nothing."""

RAYS = 6
"""Camera rays of a pixel of the first picture, about."""

TILE_RAYS = 16384
"""Camera rays of a tile, about: between tiles a picture can be given up. Smaller ones would cost more than
they do when the picture is rendered."""

LATE = 2
"""Times the seconds of a tile that have to be left for the next one: its rays may cost more than most, and
other work slows this one down."""


@dataclass(frozen=True, slots=True)
class Small:
    """A picture that was rendered.

    Attributes
    ----------
    pixels : int
    cpu_seconds : float
        Of the whole process.
    seconds : float
        By the wall clock.
    """

    pixels: int
    cpu_seconds: float
    seconds: float


class _TooLate(BaseException):
    """The deadline came before the picture was finished. No error, so nothing on its way takes it for one."""


@dataclass(slots=True)
class Growing:
    """Pictures of one target error, each larger than the one before.

    Attributes
    ----------
    scene : LoadedScene
    error : float
    precision : str
    ray_seconds : float
        CPU seconds of a camera ray, about.
    confidence : float
        Share of pictures that are to keep the target.
    pictures : list of Small
    """

    scene: LoadedScene
    error: float
    precision: str
    ray_seconds: float
    confidence: float = CONFIDENCE
    pictures: list[Small] = field(default_factory=list)

    @property
    def camera(self) -> Camera:
        """The camera of the whole picture."""
        return self.scene.document.camera

    @property
    def whole(self) -> bool:
        """Whether the last picture was the whole one."""
        return bool(self.pictures) and self.pictures[-1].pixels == self.camera.width * self.camera.height

    def run(self, wished: Deadline, deadline: Deadline) -> None:
        """Begin pictures that should end before the wished deadline; at the other one they are given up."""
        if not self.pictures and wished.left > 0:
            self.begin(deadline)
        while self.pictures and not self.whole:
            size, expected = self._next(wished.left)
            if expected * SPARE > wished.left or not self._try(size, deadline):
                return

    def begin(self, deadline: Deadline) -> None:
        """Render the first picture: the smaller, the less time there is."""
        longer = max(self.camera.width, self.camera.height)
        side = SMALLEST
        while side > LEAST and self._expected(side / longer) > FIRST * deadline.left:
            side //= 2
        self._try(min(1.0, side / longer), deadline)

    def _expected(self, size: float) -> float:
        """Seconds of a first picture."""
        size = min(size, 1.0)
        return self.camera.width * self.camera.height * size * size * RAYS * self.ray_seconds

    def _try(self, size: float, deadline: Deadline) -> bool:
        """Render a picture, and tell whether it was finished."""
        try:
            self.pictures.append(self._render(size, deadline))
        except _TooLate:
            return False
        return True

    def _next(self, left: float) -> tuple[float, float]:
        """Size of the largest picture for which there is time, and its seconds."""
        last = self.pictures[-1]
        total = self.camera.width * self.camera.height
        now = sqrt(last.pixels / total)
        sizes = [1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 16]
        options = [(size, last.seconds * (size / now) ** (2 * POWER)) for size in sizes if size >= now * STEP]
        options = options or [(1.0, last.seconds / now ** (2 * POWER))]
        return next((option for option in options if option[1] * SPARE <= left), options[-1])

    def _render(self, size: float, deadline: Deadline) -> Small:
        tile = min(TILE_RAYS * self.ray_seconds, self._expected(size))

        def look(_: TileEvent) -> None:
            if deadline.left < LATE * tile:
                raise _TooLate

        begun = time.monotonic()
        quality = target(self.error, self.precision, confidence=self.confidence)
        plan = compiled(_resized(self.scene, size), quality)
        cpu = time.process_time()
        render_adaptively(plan, quality, look, None, None)
        spent = time.process_time() - cpu
        return Small(plan.width * plan.height, spent, time.monotonic() - begun)

    def cpu_seconds(self) -> Range | None:
        """CPU seconds of the whole picture, None if no picture was finished."""
        if not self.pictures:
            return None
        last = self.pictures[-1]
        growth = log(self.camera.width * self.camera.height / last.pixels)
        estimate = last.cpu_seconds * pow(self.camera.width * self.camera.height / last.pixels, POWER)
        unsure = UNSURE * sqrt(growth / log(4))
        return factor(sqrt(unsure**2 + UNSTEADY**2)).scaled(estimate)


def _resized(scene: LoadedScene, size: float) -> LoadedScene:
    camera = scene.document.camera
    sides = {"width": max(1, ceil(camera.width * size)), "height": max(1, ceil(camera.height * size))}
    document = scene.document.model_copy(update={"camera": camera.model_copy(update=sides)})
    return LoadedScene(document, scene.assets)
