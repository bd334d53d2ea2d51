"""How linear radiance becomes the numbers of a picture file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Closed

Stops = Annotated[float, Field(strict=True, ge=-100, le=100, allow_inf_nan=False)]


class Display(Closed):
    """The last step before a PNG. Linear files (.npy) are written without it."""

    transfer: Literal["srgb", "linear"] = Field(
        default="srgb", description="`srgb` for looking at the picture, `linear` for measuring in it."
    )
    exposure: Stops = Field(
        default=0.0, description="Stops, -100 to 100: radiance is multiplied by 2 ** exposure first."
    )
