"""Shapes: triangles, rectangles in two forms, ellipsoids, meshes."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from schemas.base import Closed, chosen_by, tag
from schemas.limits import refuse_above
from schemas.quantities import (
    Asset,
    Direction,
    Edge,
    Factor,
    Index,
    Name,
    Number,
    Point,
    Size,
    TextureCoordinate,
    cosine_between,
    parallel,
)


class CenterForm(Closed):
    """A rectangle given by its centre, the direction it faces and its size."""

    center: Point = Field(description="The centre, scene units.")
    normal: Direction = Field(description="The direction it faces, of any length.")
    tangent: Direction = Field(
        description="The direction of its width, of any length, not parallel to `normal`; it is made "
        "perpendicular to it. The height lies along the cotangent, normal x tangent."
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
                "'tangent' is parallel to 'normal'. Turn it: any direction within the surface works.",
            )
        return tangent


class CornerForm(Closed):
    """A parallelogram: the points corner + u e1 + v e2 with u and v in [0, 1]."""

    corner: Point = Field(description="The corner where uv = (0, 0), scene units.")
    edges: tuple[Edge, Edge] = Field(
        description="e1 and e2, from the corner to its two neighbours, scene units, not parallel. The normal "
        "is e1 x e2."
    )

    @field_validator("edges")
    @classmethod
    def _apart(cls, edges: tuple[Edge, Edge]) -> tuple[Edge, Edge]:
        if parallel(*edges):
            raise PydanticCustomError(
                "no_area", "The rectangle has no area: its two edges are parallel. Turn one of them."
            )
        return edges


MAX_AXIS_COSINE = 1e-6
"""Largest |cosine| between two semi-axes of an ellipsoid, dimensionless."""


class _Shape(Closed):
    material: Name = Field(description="The name of one of the scene's materials.")
    name: Name | None = Field(default=None, description="A name for people; nothing depends on it.")


class Triangle(_Shape):
    """A flat triangle, visible from both sides. One without area is left out, with a warning."""

    type: Literal["triangle"]
    vertices: tuple[Point, Point, Point] = Field(description="The three corners, scene units.")
    normals: tuple[Direction, Direction, Direction] | None = Field(
        default=None, description="A normal at each corner, of any length, for smooth shading."
    )
    uvs: tuple[TextureCoordinate, TextureCoordinate, TextureCoordinate] | None = Field(
        default=None,
        description="Texture coordinates (u, v) at each corner, dimensionless; by default (0, 0), (1, 0) and "
        "(0, 1).",
    )


class Rectangle(_Shape, CenterForm):
    """A rectangle given by its centre.

    uv is (0, 0) at the corner -tangent, -cotangent and (1, 1) at the opposite one.
    """

    type: Literal["rectangle"]


class Parallelogram(_Shape, CornerForm):
    """A rectangle given by a corner and two edges, which need not be perpendicular. uv is (u, v)."""

    type: Literal["rectangle"]


class Ellipsoid(_Shape):
    """An ellipsoid given by its semi-axes a, b, c.

    u is the longitude about c, starting at a; v is the latitude, starting at -c; both go from 0 to 1.
    """

    type: Literal["ellipsoid"]
    center: Point = Field(description="The centre, scene units.")
    axes: tuple[Edge, Edge, Edge] = Field(
        description="Three perpendicular semi-axes, from the centre to the surface, scene units: the cosine "
        "of the angle between any two is at most 1e-6."
    )

    @field_validator("axes")
    @classmethod
    def _perpendicular(cls, axes: tuple[Edge, Edge, Edge]) -> tuple[Edge, Edge, Edge]:
        worst = max(abs(cosine_between(a, b)) for a, b in itertools.combinations(axes, 2))
        if worst > MAX_AXIS_COSINE:
            raise PydanticCustomError(
                "not_perpendicular",
                "The three axes must be perpendicular: the cosine of an angle between two of them is "
                "{cosine}, and at most 1e-6 is allowed. Write them with more digits, or rotate them.",
                {"cosine": f"{worst:.3g}"},
            )
        return axes


class Sphere(_Shape):
    """An ellipsoid with one radius. Its axes a, b, c are x, y, z."""

    type: Literal["ellipsoid"]
    center: Point = Field(description="The centre, scene units.")
    radius: Size = Field(description="The radius, scene units.")


class Turn(Closed):
    """A rotation about an axis through the origin."""

    axis: Direction = Field(description="Direction of the axis, of any length; rotation is right-handed.")
    degrees: Number = Field(description="Angle of rotation, degrees.")


def _on_all_axes(scale: Any) -> Any:
    return (scale,) * 3 if isinstance(scale, int | float) else scale


# Not a union: errors within one of its members would have places that no document has.
Scale = Annotated[
    tuple[Factor, Factor, Factor],
    BeforeValidator(_on_all_axes, json_schema_input_type=Factor | tuple[Factor, Factor, Factor]),
]


class _Mesh(_Shape):
    """Many triangles that are scaled first, then rotated, then moved."""

    scale: Scale = Field(
        default=(1.0, 1.0, 1.0),
        description="A factor, or one for each axis, dimensionless, not 0. A negative one mirrors; outside "
        "stays outside.",
    )
    rotate: Turn | None = Field(default=None, description="Rotation about the origin, after scaling.")
    translate: Point = Field(default=(0.0, 0.0, 0.0), description="Translation, after rotation, scene units.")
    smooth: bool = Field(
        default=False,
        strict=True,
        description="Whether normals are interpolated between the vertices, each the mean over its "
        "triangles, weighted by angle.",
    )


class Mesh(_Mesh):
    """A mesh written out in the scene."""

    type: Literal["mesh"]
    vertices: tuple[Point, ...] = Field(min_length=3, description="Positions, scene units.")
    triangles: tuple[tuple[Index, Index, Index], ...] = Field(
        min_length=1, description="Three vertex indices each, from 0, counter-clockwise seen from outside."
    )
    uvs: tuple[TextureCoordinate, ...] | None = Field(
        default=None,
        description="Texture coordinates (u, v) of each vertex, dimensionless; by default (0, 0), (1, 0) and "
        "(0, 1) at the corners of each triangle.",
    )

    @field_validator("triangles")
    @classmethod
    def _within_limits(
        cls, triangles: tuple[tuple[int, int, int], ...], info: ValidationInfo
    ) -> tuple[tuple[int, int, int], ...]:
        refuse_above(len(triangles), info, "max_triangles", "triangles")
        return triangles

    @field_validator("uvs")
    @classmethod
    def _one_each(
        cls, uvs: tuple[TextureCoordinate, ...] | None, info: ValidationInfo
    ) -> tuple[TextureCoordinate, ...] | None:
        count = len(info.data.get("vertices", ()))
        if uvs is not None and count and len(uvs) != count:
            raise PydanticCustomError(
                "not_one_each",
                "There are {given} texture coordinates for {count} vertices. Give one for each vertex.",
                {"given": len(uvs), "count": count},
            )
        return uvs


class MeshFile(_Mesh):
    """A mesh in a file: OBJ, PLY or glTF 2.0.

    glTF is a GLB, or a `.gltf` file with its buffers inside or beside it. Triangles and texture coordinates
    are read and placed by the nodes, and tangents follow from both; materials, pictures, animations and skins
    are left out.
    """

    type: Literal["mesh"]
    asset: Asset = Field(
        description="The file: its name in the scene's folder, or `sha256:<hex>` of an uploaded file."
    )


Shape = Annotated[
    Annotated[Triangle, tag(Triangle)]
    | Annotated[Rectangle, tag(Rectangle)]
    | Annotated[Parallelogram, tag(Parallelogram)]
    | Annotated[Ellipsoid, tag(Ellipsoid)]
    | Annotated[Sphere, tag(Sphere)]
    | Annotated[Mesh, tag(Mesh)]
    | Annotated[MeshFile, tag(MeshFile)],
    chosen_by(
        {
            "triangle": (Triangle,),
            "rectangle": (Rectangle, Parallelogram),
            "ellipsoid": (Ellipsoid, Sphere),
            "mesh": (Mesh, MeshFile),
        }
    ),
]
