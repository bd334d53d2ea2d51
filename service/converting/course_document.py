"""The scene files of ShanghaiTech's course CS171, as its skeleton code reads them.

The fields are those of `struct Config` in the published skeleton of assignment 4, and of students' programs
that grew from it: there an object is named by `path` and moved by `position`, and a light may be a point.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import AliasChoices, Field

from schemas.cameras import FieldOfView
from schemas.quantities import Asset, Color, Count, Direction, Index, Name, Point, Size
from schemas.shapes import Scale
from service.converting.reading import Foreign


class CourseCamera(Foreign):
    """`cam_config`."""

    position: Point
    look_at: Point
    ref_up: Direction = (0.0, 1.0, 0.0)
    vertical_fov: FieldOfView
    focal_length: Size = 1.0


class CourseLight(Foreign):
    """`light_config`: a rectangle that lies flat and shines downwards; without a size a point."""

    position: Point
    size: tuple[Size, Size] | None = None
    radiance: Color


class CourseMaterial(Foreign):
    """One of `materials`."""

    name: Name
    type: Annotated[str, Field(strict=True)] = "diffuse"
    color: Color


class CourseObject(Foreign):
    """One of `objects`: a mesh, scaled first and then moved."""

    # Which tree finds its triangles changes no picture.
    SILENT: ClassVar[frozenset[str]] = frozenset({"has_bvh"})

    # Documents alone are made into objects, never keywords.
    obj_file_path: Asset = Field(  # type: ignore[pydantic-alias]
        validation_alias=AliasChoices("obj_file_path", "path")
    )
    material_name: Name
    translate: Point = Field(  # type: ignore[pydantic-alias]
        default=(0.0, 0.0, 0.0), validation_alias=AliasChoices("translate", "position")
    )
    scale: Scale = (1.0, 1.0, 1.0)


class CourseDocument(Foreign):
    """The whole file."""

    spp: Count | None = None
    max_depth: Index | None = None
    image_resolution: tuple[Count, Count]
    cam_config: CourseCamera
    light_config: CourseLight | None = None
    materials: tuple[CourseMaterial, ...] = ()
    objects: tuple[CourseObject, ...] = ()
