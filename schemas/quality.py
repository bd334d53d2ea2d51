"""What a request asks for in place of the scene's own sampling."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Closed
from schemas.sampling import Antialiasing, LightSampling
from schemas.unions import chosen_by, tag

CONFIDENCE = 0.95
"""Share of pictures of target quality that keep their target, unless another is asked for."""


class FixedQuality(Closed):
    """Exactly the samples asked for: every sample is evaluated, every pixel is their mean."""

    mode: Literal["fixed"] = Field(default="fixed", description="`fixed`.")
    antialiasing: Antialiasing | None = Field(
        default=None, description="Camera samples; by default those of the scene."
    )
    light: LightSampling | None = Field(
        default=None, description="Light points; by default those of the scene."
    )
    precision: Literal["single", "double"] = Field(
        default="single",
        description="Arithmetic of the work on pairs of point and light: float32 or float64.",
    )


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
    precision: Literal["single", "double"] = Field(
        default="single",
        description="Arithmetic of the work on pairs of point and light: float32 or float64.",
    )


Quality = Annotated[
    Annotated[FixedQuality, tag(FixedQuality)] | Annotated[TargetQuality, tag(TargetQuality)],
    chosen_by({"fixed": (FixedQuality,), "target": (TargetQuality,)}, field="mode"),
]
"""How a picture is sampled: a number of samples, or an error."""
