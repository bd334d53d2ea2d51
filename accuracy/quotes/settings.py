"""The qualities that a quote predicts: two ladders of fixed counts, and target errors."""

from dataclasses import dataclass
from math import isqrt

from accuracy.variations import fixed_quality, seeded
from renderer.compiling import compile_scene
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from schemas.quality import (
    CONFIDENCE,
    SQUARE_PATTERNS,
    FixedQuality,
    LightSampling,
    Quality,
    Sampling,
    TargetQuality,
)

COUNTS = (1, 4, 16, 64, 256)
"""Camera samples of the rungs of a ladder: square numbers, as some patterns need them."""

MEASURED = (1, 4, 16)
"""Those whose errors a pilot measures; the others follow from these."""

ERRORS = (4 / 255, 2 / 255, 1 / 255)
"""Target errors that are always priced."""

MOST = 4096
"""Camera samples beyond which no count is offered: where they do not suffice, the pattern is the wrong
one."""


@dataclass(frozen=True, slots=True)
class Ladder:
    """Qualities that only differ in the number of camera samples.

    Attributes
    ----------
    pattern : str
        Of the camera samples.
    light : LightSampling
    precision : str
    """

    pattern: str
    light: LightSampling
    precision: str

    @property
    def counts(self) -> tuple[int, ...]:
        """Counts on offer."""
        return (1,) if self.pattern == "center" else COUNTS

    @property
    def measured(self) -> tuple[int, ...]:
        """Counts whose errors are measured."""
        return tuple(count for count in MEASURED if count in self.counts)

    def quality(self, count: int) -> FixedQuality:
        """A rung, as a job request has it."""
        return fixed_quality(self.pattern, count, self.light.pattern, self.light.samples, self.precision)

    def at_least(self, count: float) -> int | None:
        """The least count that the pattern allows and that is not below `count`; None if there is none."""
        if not count <= self.counts[-1] ** 2 or count > MOST:
            return None
        whole = max(int(-(-count // 1)), 1)
        root = isqrt(whole - 1) + 1
        return root * root if self.pattern in SQUARE_PATTERNS else whole

    def at_most(self, count: float) -> int | None:
        """The greatest count that the pattern allows and that is not above `count`; None if there is none."""
        whole = int(min(count, self.counts[-1] ** 2, MOST))
        if whole < 1:
            return None
        return isqrt(whole) ** 2 if self.pattern in SQUARE_PATTERNS else whole


def own_ladder(sampling: Sampling, quality: Quality | None) -> tuple[Ladder, int]:
    """The ladder of the requested quality or the scene's own sampling, and the number of samples in it."""
    fixed = quality if isinstance(quality, FixedQuality) else None
    antialiasing = (fixed and fixed.antialiasing) or sampling.antialiasing
    light = (fixed and fixed.light) or sampling.light
    ladder = Ladder(antialiasing.pattern, light, quality.precision if quality else "single")
    return ladder, antialiasing.samples


def sobol_ladder(precision: str) -> Ladder:
    """The ladder of the patterns whose error falls fastest, with few light points for each camera sample."""
    return Ladder("sobol", LightSampling(pattern="sobol", samples=4), precision)


def compiled(scene: LoadedScene, quality: Quality, seed: int | None = None) -> RenderPlan:
    """The plan of a quality, with another seed if one is given."""
    return compile_scene(scene if seed is None else seeded(scene, seed), quality)


def target(
    error: float, precision: str, limit: float | None = None, confidence: float = CONFIDENCE
) -> TargetQuality:
    """A target quality, as a job request has it."""
    members = {"error": error, "confidence": confidence, "time_limit": limit, "precision": precision}
    return TargetQuality.model_validate({"mode": "target"} | members)
