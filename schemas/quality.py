"""Quality of a picture: fixed numbers of samples, or a target error."""

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
    """Camera samples in each pixel, which is their mean."""

    pattern: Literal["center", "uniform", "rotated", "random", "stratified", "sobol"] = Field(
        default="uniform",
        description="`center` is one sample in the middle; `uniform` the centres of n x n cells; `rotated` "
        "that grid turned by atan(1/2) = 26.565 degrees and wrapped back into the pixel; `random` is "
        "independent; `stratified` is jittered in cells; `sobol` is a scrambled Sobol sequence.",
    )
    samples: Count = Field(
        default_factory=_default_samples,
        validate_default=True,
        description="Samples per pixel, 1 to 65536; by default 4, and always 1 for `center`. `uniform` and "
        "`rotated` need a square number.",
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
        refuse_above(samples, info, "max_samples", "camera samples per pixel")
        return samples


class LightSampling(Closed):
    """Points on each rectangle light, per camera sample. The light is their mean."""

    pattern: Literal["uniform", "random", "stratified", "sobol"] = Field(
        default="uniform",
        description="`uniform` is the centres of n x n cells; `random` is independent; `stratified` is "
        "jittered in cells; `sobol` is a scrambled Sobol sequence.",
    )
    samples: Count = Field(
        default=16,
        validate_default=True,
        description="Points per light, 1 to 65536; `uniform` needs a square number. Point and directional "
        "lights always take one.",
    )

    @field_validator("samples")
    @classmethod
    def _fit_pattern(cls, samples: int, info: ValidationInfo) -> int:
        _check_square(samples, info.data.get("pattern"))
        refuse_above(samples, info, "max_light_samples", "light points per camera sample")
        return samples


class Sampling(Closed):
    """The samples of a scene. Every one of them is evaluated."""

    antialiasing: Antialiasing = Field(
        default_factory=Antialiasing, description="Camera samples in each pixel."
    )
    light: LightSampling = Field(default_factory=LightSampling, description="Points on each rectangle light.")
    seed: Seed = Field(
        default=0,
        description="Chooses the random numbers, 0 to 2^53 - 1. They depend only on seed, pixel, sample and "
        "dimension.",
    )


CONFIDENCE = 0.95
"""Share of pictures of target quality that reach their target, unless another is requested."""


Precision = Annotated[
    Literal["single", "double"],
    Field(description="Arithmetic on pairs of a shading point and a light point: float32 or float64."),
]


class FixedQuality(Closed):
    """Exactly the requested samples: each is evaluated, and a pixel is their mean."""

    mode: Literal["fixed"] = Field(default="fixed", description="`fixed`.")
    antialiasing: Antialiasing | None = Field(
        default=None, description="Camera samples; by default those of the scene."
    )
    light: LightSampling | None = Field(
        default=None, description="Light points; by default those of the scene."
    )
    precision: Precision = "single"


class TargetQuality(Closed):
    """As many samples as an error requires, where they are needed.

    The picture is rendered in passes until its error is at most `error` with the requested `confidence`, or
    the time limit is reached.
    """

    mode: Literal["target"] = Field(
        default="target", description="`target`; may be left out where there is an `error`."
    )
    error: Annotated[float, Field(strict=True, ge=1e-6, le=1)] = Field(
        description="Root mean square error of the linear picture, clipped to 0..1, over its pixels and "
        "channels, 1e-6 to 1. One code value of an 8-bit picture is 0.0039.",
    )
    confidence: Annotated[float, Field(strict=True, ge=0.5, lt=1)] = Field(
        default=CONFIDENCE,
        description="Share of pictures whose error must be at most `error`, from 0.5 to less than 1. With "
        "0.5 the estimated error has to reach `error`; a higher confidence requires a lower estimate.",
    )
    time_limit: Annotated[float, Field(strict=True, gt=0, le=86400)] | None = Field(
        default=None,
        description="Seconds after which rendering stops with the error reached so far; by default there is "
        "no limit.",
    )
    precision: Precision = "single"


Quality = Annotated[
    Annotated[FixedQuality, tag(FixedQuality)] | Annotated[TargetQuality, tag(TargetQuality)],
    chosen_by({"fixed": (FixedQuality,), "target": (TargetQuality,)}, field="mode"),
]
"""Quality of a picture: numbers of samples, or an error."""
