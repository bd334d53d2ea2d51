"""A rectangle of a picture: ``POST /v1/jobs/{id}/focus``."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.quantities import WHOLE

Edge = Annotated[int, Field(strict=True, ge=0), WHOLE]


class Region(Closed):
    """The pixels [x0, x1) x [y0, y1), columns from the left and rows from the top."""

    x0: Edge = Field(description="First column.")
    y0: Edge = Field(description="First row.")
    x1: Edge = Field(description="The column after the last.")
    y1: Edge = Field(description="The row after the last.")

    @model_validator(mode="after")
    def _holds_a_pixel(self) -> Self:
        if self.x0 >= self.x1 or self.y0 >= self.y1:
            raise PydanticCustomError(
                "no_pixels", "This rectangle has no pixels: x0 must be below x1, and y0 below y1."
            )
        return self
