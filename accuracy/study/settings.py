"""The settings that a study tries: patterns with their numbers of samples, and target errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from accuracy.variations import fixed_quality
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from collections.abc import Iterator

    from schemas.quality import Quality

Precision = Literal["single", "double"]

PATTERNS = {
    "uniform": "uniform",
    "rotated": "uniform",
    "random": "random",
    "stratified": "stratified",
    "sobol": "sobol",
}
"""Patterns of camera samples, each with the pattern of light points that goes with it. `center` is `uniform`
with one sample."""

REGULAR_PATTERNS = ("uniform", "rotated")
"""Patterns with the same light points for every camera sample: more camera samples do not replace light
points, so both must grow."""

TARGET = "target"
"""The method that takes a target error."""

METHODS = (*PATTERNS, TARGET)

REFERENCE_PATTERN = "sobol"
"""Pattern of references, and of everything that is compared at one setting."""

FEW_POINTS = ((1, 1), (1, 4), (1, 16), (1, 64), (4, 1), (4, 4), (4, 16), (4, 64), (16, 4), (16, 16), (64, 4))
MANY_POINTS = (*FEW_POINTS, (16, 64), (64, 16))


@dataclass(frozen=True, slots=True)
class Scale:
    """The extent of a study.

    Attributes
    ----------
    side : int
        Most pixels along the longer side of its pictures.
    references : tuple of int
        Camera samples of each half of the reference, the best first; the others are for small budgets.
    random, regular : tuple of (camera samples, light points)
        For patterns with new light points for each camera sample, and with the same ones.
    errors_255 : tuple of float
        Targets, in units of 1/255.
    seeds : int
        Renders of a setting, each with other random numbers.
    """

    side: int = 256
    references: tuple[int, ...] = (256, 64, 16)
    random: tuple[tuple[int, int], ...] = FEW_POINTS
    regular: tuple[tuple[int, int], ...] = MANY_POINTS
    errors_255: tuple[float, ...] = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
    seeds: int = 3


FULL = Scale()

QUICK = Scale(
    side=48,
    references=(64,),
    random=((1, 1), (4, 1), (4, 4), (16, 4)),
    regular=((1, 1), (4, 1), (4, 4), (16, 4)),
    errors_255=(8.0, 4.0),
)
"""A report of a few settings, in seconds."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A quality and its method.

    Attributes
    ----------
    method : str
        One of `METHODS`.
    quality : Quality
    """

    method: str
    quality: Quality

    @property
    def name(self) -> str:
        """The name in tables: `sobol 16 x 4`, `target 1/255`."""
        return f"{self.method} {self.counts}"

    @property
    def counts(self) -> str:
        """Camera samples x light points, or the target error."""
        if isinstance(self.quality, TargetQuality):
            return f"{self.quality.error * 255:g}/255"
        return f"{self.samples} x {self.points}"

    @property
    def samples(self) -> int:
        """Camera samples a pixel; 0 for a target, which chooses them itself."""
        asked = None if isinstance(self.quality, TargetQuality) else self.quality.antialiasing
        return asked.samples if asked else 0

    @property
    def points(self) -> int:
        """Light points a camera sample; 0 for a target."""
        asked = None if isinstance(self.quality, TargetQuality) else self.quality.light
        return asked.samples if asked else 0


def fixed(pattern: str, samples: int, points: int, precision: Precision = "single") -> Setting:
    """The setting with these camera samples and light points.

    Examples
    --------
    >>> fixed("rotated", 16, 4).name
    'rotated 16 x 4'
    """
    return Setting(pattern, fixed_quality(pattern, samples, PATTERNS[pattern], points, precision))


def targeted(error_255: float) -> Setting:
    """The setting with a target error, in units of 1/255.

    Examples
    --------
    >>> targeted(0.5).name
    'target 0.5/255'
    """
    return Setting(TARGET, TargetQuality(mode="target", error=error_255 / 255))


def swept(scale: Scale, *, area_lights: bool) -> Iterator[Setting]:
    """All settings of a study; without area lights the number of light points is always 1."""
    for pattern in PATTERNS:
        counts = scale.regular if pattern in REGULAR_PATTERNS else scale.random
        kept = counts if area_lights else tuple(dict.fromkeys((samples, 1) for samples, _ in counts))
        yield from (fixed(pattern, samples, points) for samples, points in kept)
    yield from map(targeted, scale.errors_255)
