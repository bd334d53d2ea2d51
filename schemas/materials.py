"""Materials: the Phong model with a colour or a colour texture, and a normal map where one is wanted."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed
from schemas.quantities import LARGEST, Color, Intensity, Name
from schemas.unions import chosen_by, tag

Shininess = Annotated[float, Field(strict=True, ge=0, le=LARGEST, allow_inf_nan=False)]

Height = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]


class PhongMaterial(Closed):
    """The Phong model. It has exactly one of `color` and `color_texture`.

    Radiance towards the viewer: ambient_light * ambient * color, plus for every light the mean over its
    points of visibility * light.color * (diffuse * color * max(0, n.l)
    + specular * max(0, r.v) ** shininess).
    """

    type: Literal["phong"]
    color: Color | None = Field(default=None, description="Linear RGB, each 0 or more.")
    color_texture: Name | None = Field(
        default=None, description="The name of one of the scene's textures, in place of `color`."
    )
    ambient: Intensity = Field(default=0.1, description="Share of the scene's ambient light, dimensionless.")
    diffuse: Intensity = Field(default=1.0, description="Strength of the diffuse term, dimensionless.")
    specular: Intensity = Field(default=0.0, description="Strength of the highlight, dimensionless.")
    shininess: Shininess = Field(
        default=20.0,
        description="Exponent of the highlight, dimensionless: the larger, the smaller and sharper.",
    )
    normal_map: Name | None = Field(
        default=None,
        description="The name of an image texture whose colours c stand for normals 2 c - 1 in "
        "(tangent, cotangent, normal).",
    )
    bump_map: Name | None = Field(
        default=None,
        description="The name of an image texture of heights, the mean of its channels as stored. Normals are those "
        "of the surface with these heights; nothing is moved.",
    )
    bump_height: Height = Field(default=0.0, description="Height of white in the bump map, scene units.")
    displacement_map: Name | None = Field(
        default=None,
        description="The name of an image texture of heights, the mean of its channels as stored. The surface is "
        "really moved along its normal and casts shadows on itself: it is cut into triangles with edges of "
        "2 pixels, at most 400,000 of them a shape.",
    )
    displacement_height: Height = Field(
        default=0.0, description="Height of white in the displacement map, scene units."
    )

    @model_validator(mode="after")
    def _one_color(self) -> Self:
        if (self.color is None) == (self.color_texture is None):
            raise PydanticCustomError(
                "one_color", "A material has exactly one of 'color' and 'color_texture'. Give one of the two."
            )
        return self


Material = Annotated[Annotated[PhongMaterial, tag(PhongMaterial)], chosen_by({"phong": (PhongMaterial,)})]
