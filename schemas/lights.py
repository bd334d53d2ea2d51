"""Lights: rectangles in two forms, points, directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.base import Closed, chosen_by, tag
from schemas.quantities import Color, Direction, Point
from schemas.shapes import CenterForm, CornerForm


class _Light(Closed):
    color: Color = Field(description="Linear RGB, each 0 or more.")


class _AreaLight(_Light):
    visible: bool = Field(
        default=True,
        strict=True,
        description="Whether camera, reflected and refracted rays see the light: in its flat colour, from "
        "both sides even if it shines to one. It hides what lies behind it.",
    )
    two_sided: bool = Field(
        default=True,
        strict=True,
        description="Whether it shines to both sides, or only to the side of its normal.",
    )
    falloff: Literal["none", "physical"] = Field(
        default="none",
        description="`none`: brightness does not depend on distance. `physical`: every point of the light "
        "counts cos(angle) area / (pi distance^2), with the angle at the light. Scaling the whole scene "
        "changes nothing.",
    )


class RectangleLight(_AreaLight, CenterForm):
    """A rectangular light given by its centre. It makes soft shadows, and casts no shadow itself."""

    type: Literal["rectangle"]


class ParallelogramLight(_AreaLight, CornerForm):
    """A rectangular light given by a corner and two edges, which need not be perpendicular."""

    type: Literal["rectangle"]


class PointLight(_Light):
    """A light at one point. It makes hard shadows."""

    type: Literal["point"]
    position: Point = Field(description="Its position, scene units.")
    falloff: Literal["none", "physical"] = Field(
        default="none",
        description="`none`: brightness does not depend on distance. `physical`: 1 / distance^2 in scene "
        "units, so a scene of twice the size needs four times the colour.",
    )


class DirectionalLight(_Light):
    """A light infinitely far away, like the sun. It makes hard shadows, and has no falloff."""

    type: Literal["directional"]
    direction: Direction = Field(description="The direction in which the light travels, of any length.")


Light = Annotated[
    Annotated[RectangleLight, tag(RectangleLight)]
    | Annotated[ParallelogramLight, tag(ParallelogramLight)]
    | Annotated[PointLight, tag(PointLight)]
    | Annotated[DirectionalLight, tag(DirectionalLight)],
    chosen_by(
        {
            "rectangle": (RectangleLight, ParallelogramLight),
            "point": (PointLight,),
            "directional": (DirectionalLight,),
        }
    ),
]
