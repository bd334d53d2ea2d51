"""The two forms of a flat four-sided figure, which rectangles and rectangle lights share."""

from __future__ import annotations

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.quantities import Direction, Edge, Point, Size
from schemas.vectors import parallel


class CenterForm(Closed):
    """A rectangle given by its middle, the way it faces and its size."""

    center: Point = Field(description="The middle, scene units.")
    normal: Direction = Field(description="The direction it faces, of any length.")
    tangent: Direction = Field(
        description="The direction of its width, of any length; made exactly perpendicular to `normal`, "
        "not parallel to it. The direction of the height is the cotangent, normal x tangent."
    )
    size: tuple[Size, Size] = Field(
        description="Width along the tangent and height along the cotangent, scene units."
    )

    @field_validator("tangent")
    @classmethod
    def _across(cls, tangent: Direction, info: ValidationInfo) -> Direction:
        normal = info.data.get("normal")
        if normal is not None and parallel(normal, tangent):
            raise PydanticCustomError(
                "parallel",
                "'tangent' is parallel to 'normal'. Turn it: any direction in the surface will do.",
            )
        return tangent


class CornerForm(Closed):
    """A parallelogram: the points corner + u e1 + v e2 with u and v in [0, 1]."""

    corner: Point = Field(description="The corner where uv = (0, 0), scene units.")
    edges: tuple[Edge, Edge] = Field(
        description="e1 and e2, from the corner to its two neighbours, scene units. The normal is e1 x e2. "
        "They "
        "need not be perpendicular, only not parallel."
    )

    @field_validator("edges")
    @classmethod
    def _apart(cls, edges: tuple[Edge, Edge]) -> tuple[Edge, Edge]:
        if parallel(*edges):
            raise PydanticCustomError(
                "no_area", "The rectangle has no area: its two edges are parallel. Turn one of them."
            )
        return edges
