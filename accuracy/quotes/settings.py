"""The qualities that a quote predicts: two ladders of fixed counts, and target errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isqrt

from accuracy.variations import fixed_quality, seeded
from renderer.compiling import at_quality
from renderer.plan.plan import RenderPlan
from schemas.quality import (
    CONFIDENCE,
    SQUARE_PATTERNS,
    FixedQuality,
    LightSampling,
    Quality,
    Sampling,
    TargetQuality,
)

LADDER_SAMPLES = (1, 4, 16, 64, 256)
"""Camera samples of a ladder of qualities: square numbers, which some patterns need."""

LADDER_ERRORS = (4 / 255, 2 / 255, 1 / 255)
"""Target errors that are always priced."""

MIN_ERROR = 1e-6
"""Smallest error that target quality takes."""

MAX_SAMPLES = 4096
"""Most camera samples of an offer: if they do not suffice, the pattern is the wrong one."""


@dataclass(frozen=True, slots=True)
class Ladder:
    """Qualities that differ only in the number of camera samples, with their pattern and light sampling."""

    pattern: str
    light: LightSampling
    precision: str

    @property
    def counts(self) -> tuple[int, ...]:
        """Offered counts."""
        return (1,) if self.pattern == "center" else LADDER_SAMPLES

    @property
    def allowed(self) -> Sequence[int]:
        """All counts that the pattern allows."""
        if self.pattern == "center":
            return self.counts
        squares = self.pattern in SQUARE_PATTERNS
        return (
            [side**2 for side in range(1, isqrt(MAX_SAMPLES) + 1)] if squares else range(1, MAX_SAMPLES + 1)
        )

    def quality(self, count: int) -> FixedQuality:
        """The quality with so many samples, as in a job request."""
        return fixed_quality(self.pattern, count, self.light.pattern, self.light.samples, self.precision)


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


def planned(plan: RenderPlan, quality: Quality, more: int = 0) -> RenderPlan:
    """The plan of the same scene at another quality and with another seed."""
    return at_quality(replace(plan, scene=seeded(plan.scene, plan.seed + more)), quality)


def target(
    error: float, precision: str, limit: float | None = None, confidence: float = CONFIDENCE
) -> TargetQuality:
    """A target quality, as in a job request."""
    members = {"error": error, "confidence": confidence, "time_limit": limit, "precision": precision}
    return TargetQuality.model_validate({"mode": "target"} | members)
