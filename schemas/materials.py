"""Materials: colours, maps and further rays of surfaces, and the Phong model of what they reflect."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed, chosen_by, tag
from schemas.quantities import MAX_COORDINATE, MAX_INTENSITY, MIN_SIZE, WHOLE, Color, Intensity, Name

Shininess = Annotated[float, Field(strict=True, ge=0, le=MAX_COORDINATE, allow_inf_nan=False)]

Share = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]

RefractiveIndex = Annotated[float, Field(strict=True, ge=MIN_SIZE, le=MAX_INTENSITY, allow_inf_nan=False)]

Depth = Annotated[int, Field(strict=True, ge=1, le=64), WHOLE]

Height = Annotated[float, Field(strict=True, ge=-MAX_COORDINATE, le=MAX_COORDINATE, allow_inf_nan=False)]


class Surface(Closed):
    """Attributes of all materials, apart from their reflection of lights."""

    type: str
    color: Color | None = Field(default=None, description="Linear RGB, each 0 or more.")
    color_texture: Name | None = Field(
        default=None, description="The name of one of the scene's textures, instead of `color`."
    )
    ambient: Intensity = Field(default=0.1, description="Share of the scene's ambient light, dimensionless.")
    normal_map: Name | None = Field(
        default=None,
        description="The name of an image texture whose colours c encode normals 2 c - 1 in "
        "(tangent, cotangent, normal). u grows along the tangent; the cotangent is normal x tangent, or the "
        "opposite where texture coordinates are mirrored, as in glTF.",
    )
    bump_map: Name | None = Field(
        default=None,
        description="The name of an image texture of heights, the mean of its channels as stored. It changes "
        "normals to those of the raised surface, but moves nothing.",
    )
    bump_height: Height = Field(default=0.0, description="Height of white in the bump map, scene units.")
    displacement_map: Name | None = Field(
        default=None,
        description="The name of an image texture of heights, the mean of its channels as stored. It moves "
        "the surface along its normal, so that it casts shadows on itself. The surface is divided into "
        "triangles with edges of 2 pixels, at most 400,000 in a scene. Shapes with the same map and height "
        "stay closed along borders with identical corner coordinates.",
    )
    displacement_height: Height = Field(
        default=0.0, description="Height of white in the displacement map, scene units."
    )

    mirror: Share = Field(default=0.0, description="Share of the reflected radiance, 0 to 1.")
    transmission: Share = Field(
        default=0.0, description="Share of the radiance that is reflected and refracted as in glass, 0 to 1."
    )
    ior: RefractiveIndex = Field(
        default=1.5,
        description="Refractive index inside relative to outside. Inside is behind the outward normal: a ray "
        "that hits the front of a rectangle or triangle enters.",
    )
    max_depth: Depth = Field(
        default=5,
        description="A path that has bounced this often ends at this material. In glass each bounce may "
        "double the rays.",
    )

    @model_validator(mode="after")
    def _one_color(self) -> Self:
        if (self.color is None) == (self.color_texture is None):
            raise PydanticCustomError(
                "one_color", "A material has exactly one of 'color' and 'color_texture'. Give one of the two."
            )
        return self

    @model_validator(mode="after")
    def _no_more_than_all(self) -> Self:
        # The parts of scattered rays sum to 1 at most, so weights never grow along a path.
        if self.mirror + self.transmission > 1:
            raise PydanticCustomError(
                "more_than_all",
                "'mirror' and 'transmission' add up to {sum}: more light than the surface receives. "
                "Make their sum 1 or less.",
                {"sum": f"{self.mirror + self.transmission:.3g}"},
            )
        return self


class PhongMaterial(Surface):
    """The Phong model. It has exactly one of `color` and `color_texture`.

    Radiance towards the viewer: ambient_light * ambient * color, plus for every light the mean over its
    points of visibility * light.color * (diffuse * color * max(0, n.l) +
    specular * max(0, r.v) ** shininess), plus mirror * L(reflected), plus
    transmission * (F * L(reflected) + (1 - F) * L(refracted)): Whitted's model. L is the radiance that comes
    along a further ray, F the share of unpolarised light that a dielectric reflects, by Fresnel's formulas;
    1 where all of it is. Rays are reflected and refracted about the shading normal, yet never to the wrong
    side of the surface.

    A path ends after `max_depth` bounces, or when it can add at most 2**-24, half the spacing of float32 at
    1, to its sample: its weight, the product of these factors, times the largest radiance that background,
    lights and materials of the scene allow, or times 1 if that is less. Physical falloff has no largest
    radiance, so there `max_depth` alone ends paths. From the sixth bounce on, one ray goes on in place of
    those that leave a point with weights below 2**-12, chosen by weight: the mean stays right. Every shape
    casts a full shadow, even glass.
    """

    type: Literal["phong"]
    diffuse: Intensity = Field(default=1.0, description="Strength of the diffuse term, dimensionless.")
    specular: Intensity = Field(default=0.0, description="Strength of the highlight, dimensionless.")
    shininess: Shininess = Field(
        default=20.0,
        description="Exponent of the highlight, dimensionless; larger is smaller and sharper.",
    )


HEIGHTS = {"bump_map": "bump_height", "displacement_map": "displacement_height"}
"""Maps of heights, and the field that says how high white is."""


def flat_maps(material: Surface) -> list[str]:
    """Fields with maps of heights where white is no higher than black: they change nothing."""
    written = [part for part in HEIGHTS if getattr(material, part) is not None]
    return [part for part in written if not getattr(material, HEIGHTS[part])]


def shown_textures(material: Surface) -> list[str]:
    """Fields with textures that change what the material looks like."""
    flat, parts = flat_maps(material), ("color_texture", "normal_map", *HEIGHTS)
    return [part for part in parts if getattr(material, part) is not None and part not in flat]


Material = Annotated[Annotated[PhongMaterial, tag(PhongMaterial)], chosen_by({"phong": (PhongMaterial,)})]
