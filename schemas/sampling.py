"""How many samples are taken, and where: inside a pixel, and on a light."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
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
        "that grid "
        "turned by atan(1/2) = 26.565 degrees and wrapped back into the pixel; `random` is independent; "
        "`stratified` "
        "is jittered in cells; `sobol` is a scrambled Sobol sequence.",
    )
    samples: Count = Field(
        default_factory=_default_samples,
        validate_default=True,
        description="Samples a pixel, 1 to 65536. By default 4, or 1 for `center`, which allows nothing "
        "else. "
        "For `uniform` and `rotated` a square number.",
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
        "jittered in "
        "cells; `sobol` is a scrambled Sobol sequence.",
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
