"""Lights: rectangles in two forms, points, cones, directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed, chosen_by, tag
from schemas.quantities import Color, Direction, Point
from schemas.shapes import CenterForm, CornerForm

OuterAngle = Annotated[float, Field(strict=True, ge=1e-3, le=90, allow_inf_nan=False)]
InnerAngle = Annotated[float, Field(strict=True, ge=0, lt=90, allow_inf_nan=False)]


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


class _PlacedLight(_Light):
    position: Point = Field(description="Its position, scene units.")
    falloff: Literal["none", "physical"] = Field(
        default="none",
        description="`none`: brightness does not depend on distance. `physical`: 1 / distance^2 in scene "
        "units, so a scene of twice the size needs four times the colour.",
    )


class PointLight(_PlacedLight):
    """A light at one point. It makes hard shadows."""

    type: Literal["point"]


class SpotLight(_PlacedLight):
    """A light at one point that shines into a cone. It makes hard shadows, and its edge is smooth.

    At an angle t from `direction` it counts ((cos t - cos outer_angle) /
    (cos inner_angle - cos outer_angle))**2, at most 1, and nothing from `outer_angle` on: the edge of glTF's
    KHR_lights_punctual.
    """

    type: Literal["spot"]
    direction: Direction = Field(description="The middle of the cone, as the light travels, of any length.")
    outer_angle: OuterAngle = Field(
        default=45.0, description="Angle from `direction` where the light ends, degrees, 0.001 to 90."
    )
    inner_angle: InnerAngle = Field(
        default=0.0,
        description="Angle from `direction` up to which nothing is lost, degrees, smaller than "
        "`outer_angle`.",
    )

    @field_validator("inner_angle")
    @classmethod
    def _check_edge(cls, inner: float, info: ValidationInfo) -> float:
        outer = info.data.get("outer_angle")
        if outer is not None and inner >= outer:
            raise PydanticCustomError(
                "out_of_range",
                "The edge of the cone has no width: 'inner_angle' must be smaller than 'outer_angle', which "
                "is {outer}. For a hard edge make it a little smaller.",
                {"outer": f"{outer:g}"},
            )
        return inner


class DirectionalLight(_Light):
    """A light infinitely far away, like the sun. It makes hard shadows, and has no falloff."""

    type: Literal["directional"]
    direction: Direction = Field(description="The direction in which the light travels, of any length.")


Light = Annotated[
    Annotated[RectangleLight, tag(RectangleLight)]
    | Annotated[ParallelogramLight, tag(ParallelogramLight)]
    | Annotated[PointLight, tag(PointLight)]
    | Annotated[SpotLight, tag(SpotLight)]
    | Annotated[DirectionalLight, tag(DirectionalLight)],
    chosen_by(
        {
            "rectangle": (RectangleLight, ParallelogramLight),
            "point": (PointLight,),
            "spot": (SpotLight,),
            "directional": (DirectionalLight,),
        }
    ),
]
