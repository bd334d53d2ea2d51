"""What a request asks for in place of the scene's own sampling."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from schemas.base import Closed
from schemas.sampling import Antialiasing, LightSampling


class FixedQuality(Closed):
    """Exactly the samples asked for: every sample is evaluated, every pixel is their mean."""

    mode: Literal["fixed"] = Field(description="`fixed`.")
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


Quality = FixedQuality
