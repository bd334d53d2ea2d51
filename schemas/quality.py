"""How a picture is sampled: as its scene says, or as a request says in place of it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed, chosen_by, tag
from schemas.limits import refuse_above
from schemas.quantities import WHOLE, Count

Seed = Annotated[int, Field(strict=True, ge=0, le=(1 << 53) - 1), WHOLE]
SQUARE_PATTERNS = frozenset({"uniform", "rotated"})
"""Patterns that are a grid of n x n samples."""


def _default_samples(antialiasing: dict[str, Any]) -> int:
    return 1 if antialiasing["pattern"] == "center" else 4


def _check_square(samples: int, pattern: object) -> None:
    root = math.isqrt(samples)
    if pattern in SQUARE_PATTERNS and root * root != samples:
        raise PydanticCustomError(
            "not_square",
            "The pattern '{pattern}' is a square grid, so 'samples' must be a square number. "
            "The nearest are {below} and {above}.",
            {"pattern": pattern, "below": root * root, "above": (root + 1) ** 2},
        )


class Antialiasing(Closed):
    """Camera samples inside every pixel. The pixel is their mean."""

    pattern: Literal["center", "uniform", "rotated", "random", "stratified", "sobol"] = Field(
        default="uniform",
        description="`center` is one sample in the middle; `uniform` the centres of n x n cells; `rotated` "
        "that grid turned by atan(1/2) = 26.565 degrees and wrapped back into the pixel; `random` is "
        "independent; `stratified` is jittered in cells; `sobol` is a scrambled Sobol sequence.",
    )
    samples: Count = Field(
        default_factory=_default_samples,
        validate_default=True,
        description="Samples a pixel, 1 to 65536. By default 4, or 1 for `center`, which allows nothing "
        "else. For `uniform` and `rotated` a square number.",
    )

    @field_validator("samples")
    @classmethod
    def _fit_pattern(cls, samples: int, info: ValidationInfo) -> int:
        pattern = info.data.get("pattern")
        if pattern == "center" and samples != 1:
            raise PydanticCustomError(
                "one_sample",
                "The pattern 'center' has one sample. Set 'samples' to 1, or choose another pattern.",
            )
        _check_square(samples, pattern)
        refuse_above(samples, info, "max_samples", "camera samples a pixel")
        return samples


class LightSampling(Closed):
    """Points on every rectangle light, for every camera sample. The light is their mean."""

    pattern: Literal["uniform", "random", "stratified", "sobol"] = Field(
        default="uniform",
        description="`uniform` is the centres of n x n cells; `random` is independent; `stratified` is "
        "jittered in cells; `sobol` is a scrambled Sobol sequence.",
    )
    samples: Count = Field(
        default=16,
        validate_default=True,
        description="Points a light, 1 to 65536. For `uniform` a square number. Point lights need one.",
    )

    @field_validator("samples")
    @classmethod
    def _fit_pattern(cls, samples: int, info: ValidationInfo) -> int:
        _check_square(samples, info.data.get("pattern"))
        refuse_above(samples, info, "max_light_samples", "light points a camera sample")
        return samples


class Sampling(Closed):
    """All sampling of a scene. Every sample that is asked for is evaluated."""

    antialiasing: Antialiasing = Field(
        default_factory=Antialiasing, description="Camera samples inside every pixel."
    )
    light: LightSampling = Field(
        default_factory=LightSampling, description="Points on every rectangle light."
    )
    seed: Seed = Field(
        default=0,
        description="Chooses the random numbers, 0 to 2^53 - 1. They depend on seed, pixel, sample and "
        "dimension alone.",
    )


CONFIDENCE = 0.95
"""Share of pictures of target quality that keep their target, unless another is requested."""


Precision = Annotated[
    Literal["single", "double"],
    Field(description="Arithmetic of the work on pairs of point and light: float32 or float64."),
]


class FixedQuality(Closed):
    """Exactly the samples asked for: every sample is evaluated, every pixel is their mean."""

    mode: Literal["fixed"] = Field(default="fixed", description="`fixed`.")
    antialiasing: Antialiasing | None = Field(
        default=None, description="Camera samples; by default those of the scene."
    )
    light: LightSampling | None = Field(
        default=None, description="Light points; by default those of the scene."
    )
    precision: Precision = "single"


class TargetQuality(Closed):
    """As many samples as an error asks for, where they are needed.

    The picture is rendered in passes until its error is at most `error` with the `confidence` asked for, or
    the time is spent.
    """

    mode: Literal["target"] = Field(
        default="target", description="`target`; without a mode, an `error` says so."
    )
    error: Annotated[float, Field(strict=True, ge=1e-6, le=1)] = Field(
        description="Root mean square error of the linear picture, clipped to 0..1, over its pixels and "
        "channels, 1e-6 to 1. One step of a picture of 8 bits is 0.0039.",
    )
    confidence: Annotated[float, Field(strict=True, ge=0.5, lt=1)] = Field(
        default=CONFIDENCE,
        description="Share of pictures whose error is to be at most `error`, 0.5 up to but not 1. With 0.5 "
        "the estimate of the error has to reach it; the more, the farther below it must be.",
    )
    time_limit: Annotated[float, Field(strict=True, gt=0, le=86400)] | None = Field(
        default=None,
        description="Seconds after which the picture is taken as it is, with the error that it has reached; "
        "by default it may take as long as it needs.",
    )
    precision: Precision = "single"


Quality = Annotated[
    Annotated[FixedQuality, tag(FixedQuality)] | Annotated[TargetQuality, tag(TargetQuality)],
    chosen_by({"fixed": (FixedQuality,), "target": (TargetQuality,)}, field="mode"),
]
"""How a picture is sampled: a number of samples, or an error."""
