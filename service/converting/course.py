"""Scenes of ShanghaiTech's course CS171, as read by its skeleton code.

The fields are those of `struct Config` in the published skeleton of assignment 4, and of students' programs
that grew from it: there an object is named by `path` and moved by `position`, and a light may be a point.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AliasChoices, Field

from renderer.meshes.files import file_kind
from renderer.meshes.obj import read_obj
from schemas.cameras import FieldOfView
from schemas.errors import Problem
from schemas.limits import limits_in_force
from schemas.quantities import Asset, Color, Count, Direction, Index, Name, Point, Size
from schemas.reading.translation import nearest
from schemas.shapes import Scale
from service.converting.errors import ConversionError
from service.converting.obj import bent_faces, note_left_out
from service.converting.reading import Foreign, read_known
from service.converting.task import UNUSABLE_FILE_ERRORS, Notes, Task, check_mesh


class CourseCamera(Foreign):
    """`cam_config`."""

    position: Point
    look_at: Point
    ref_up: Direction = (0.0, 1.0, 0.0)
    vertical_fov: FieldOfView
    focal_length: Size = 1.0


class CourseLight(Foreign):
    """`light_config`: a horizontal rectangle that shines downwards; without a size a point."""

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

    # Objects are made only from documents, never from keyword arguments.
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


GLASS = frozenset({"translucent", "transmission"})
"""Names that students use; the skeleton itself has only `diffuse` and `specular`."""
REFRACTIVE_INDEX = 1.5
MAX_BOUNCES = 64
"""Most bounces that a material may have."""
DEFAULT_DEPTH = 5
"""Bounces where `max_depth` is missing: the default of scenes."""


def _material(written: CourseMaterial, pointer: str, max_depth: int | None, notes: Notes) -> dict[str, Any]:
    """One material of a scene; what has no counterpart is noted."""
    kind = written.type.lower()
    if kind == "specular":
        return _share("mirror", written, pointer, max_depth, notes)
    if kind in GLASS:
        notes.assume(f"{pointer}/type", f"It is glass with a refractive index of {REFRACTIVE_INDEX}.")
        glass = _share("transmission", written, pointer, max_depth, notes)
        return glass | {"ior": REFRACTIVE_INDEX}
    if kind != "diffuse":
        notes.assume(
            f"{pointer}/type",
            "The type is unknown, so it is diffuse. Known types are diffuse, specular and translucent.",
        )
    return {"type": "phong", "color": written.color}


def _share(
    field: str, written: CourseMaterial, pointer: str, max_depth: int | None, notes: Notes
) -> dict[str, Any]:
    """A material that sends rays on and does nothing else."""
    red, green, blue = written.color
    share = min(1.0, (red + green + blue) / 3)
    if not red == green == blue == share:
        notes.assume(
            f"{pointer}/color",
            f"All colours are scattered by one share, at most 1: {share:.6g}, the mean of this colour.",
        )
    depth = max(1, min(MAX_BOUNCES, max_depth if max_depth is not None else DEFAULT_DEPTH))
    if max_depth is not None and depth != max_depth:
        notes.assume("/max_depth", f"Paths end after {depth} bounces: 1 to {MAX_BOUNCES} are possible.")
    return {
        "type": "phong",
        "color": written.color,
        "ambient": 0,
        "diffuse": 0,
        field: share,
        "max_depth": depth,
    }


DEFAULT_SAMPLES = 16
"""Camera samples a pixel where `spp` is missing."""


def convert_course(task: Task, content: object) -> dict[str, Any]:
    """The scene of a course file.

    Parameters
    ----------
    task
        The file; what is assumed is noted in it.
    content
        Its parsed JSON.

    Raises
    ------
    ConversionError
        With every field that is wrong, or every mesh that cannot be used.
    """
    text = task.content.decode("utf-8-sig")
    course = read_known(content, CourseDocument, task.notes, text)
    materials: dict[str, Any] = {}
    for number, written in enumerate(course.materials):
        if written.name in materials:
            detail = "An earlier material of the same name is replaced by this one."
            task.notes.assume(f"/materials/{number}/name", detail)
        materials[written.name] = _material(written, f"/materials/{number}", course.max_depth, task.notes)
    _note_bounces(task, course)
    return {
        "version": 1,
        "name": task.path.stem,
        "camera": _camera(task, course.cam_config, course.image_resolution),
        "materials": materials,
        "shapes": _shapes(task, course, text),
        "lights": [] if course.light_config is None else [_light(task, course.light_config)],
        "sampling": _sampling(task, course.spp),
    }


def _camera(task: Task, camera: CourseCamera, resolution: tuple[int, int]) -> dict[str, Any]:
    if camera.focal_length != 1:
        half = math.tan(math.radians(camera.vertical_fov) / 2)
        seen = math.degrees(2 * math.atan(half * camera.focal_length))
        task.notes.assume(
            "/cam_config/focal_length",
            "It places the screen and does not change the view, which is vertical_fov wide. Programs that "
            "scale only the screen by it, and not its distance, see "
            f"{seen:.6g} degrees: write that as vertical_fov to get their picture.",
        )
    width, height = resolution
    return {
        "position": camera.position,
        "look_at": camera.look_at,
        "up": camera.ref_up,
        "vertical_fov": camera.vertical_fov,
        "focal_length": camera.focal_length,
        "width": width,
        "height": height,
    }


def _light(task: Task, light: CourseLight) -> dict[str, Any]:
    if light.size is None:
        task.notes.assume(
            "/light_config",
            "Without a size it is a point, of the same brightness at every distance: set its falloff to "
            "physical where it should fall with the distance.",
        )
        return {"type": "point", "position": light.position, "color": light.radiance}
    task.notes.assume(
        "/light_config",
        "It lies flat and shines downwards only; size is its length along x and along z. radiance becomes "
        "its colour with physical falloff, which gives the same light as in a path tracer.",
    )
    return {
        "type": "rectangle",
        "center": light.position,
        "normal": [0, -1, 0],
        "tangent": [1, 0, 0],
        "size": light.size,
        "color": light.radiance,
        "two_sided": False,
        "falloff": "physical",
    }


def _sampling(task: Task, spp: int | None) -> dict[str, Any]:
    most = limits_in_force().max_samples
    samples = min(spp or DEFAULT_SAMPLES, most)
    if spp is None:
        task.notes.assume("", f"spp is missing: {DEFAULT_SAMPLES} samples per pixel are used.")
    elif spp > most:
        task.notes.assume("/spp", f"{most} samples per pixel are used, the most that a scene may ask for.")
    task.notes.assume(
        "/spp" if spp else "",
        "Samples are random, and each has one random point of the light, as in the course. Other patterns "
        "have less noise for the same time: try sobol, or render with --target-error.",
    )
    return {
        "antialiasing": {"pattern": "random", "samples": samples},
        "light": {"pattern": "random", "samples": 1},
    }


def _note_bounces(task: Task, course: CourseDocument) -> None:
    if course.max_depth is None or course.max_depth > 1:
        task.notes.leave_out(
            "/max_depth" if course.max_depth else "",
            "Light that goes from one diffuse surface to another is not rendered: what no light reaches "
            "directly is black. Set the scene's ambient to brighten it. Mirrors and glass are rendered.",
        )


def _shapes(task: Task, course: CourseDocument, text: str) -> list[dict[str, Any]]:
    names = [written.name for written in course.materials]
    problems: list[Problem] = []
    shapes = []
    for number, written in enumerate(course.objects):
        pointer = f"/objects/{number}"
        if written.material_name not in names:
            detail = "There is no material of this name. Use one of the names under 'materials'."
            problems.append(
                Problem(
                    pointer=f"{pointer}/material_name",
                    detail=detail,
                    code="unknown_material",
                    suggestion=nearest(written.material_name, names),
                )
            )
        try:
            shapes.append(_shape(task, written, pointer))
        except UNUSABLE_FILE_ERRORS as error:
            place = f"{pointer}/obj_file_path"
            problems.append(Problem(pointer=place, detail=str(error), code="unusable_file"))
    if problems:
        raise ConversionError(task.notes.file, text.encode(), problems)
    return shapes


def _shape(task: Task, written: CourseObject, pointer: str) -> dict[str, Any]:
    path, content = task.found.read(task.folder, written.obj_file_path)
    check_mesh(path.name, content)
    shape: dict[str, Any] = {
        "type": "mesh",
        "name": Path(written.obj_file_path.replace("\\", "/")).stem,
        "asset": task.placed.keep(path, content),
        "material": written.material_name,
        "scale": written.scale,
        "translate": written.translate,
    }
    if _smooth(task, path, content, f"{pointer}/obj_file_path"):
        shape["smooth"] = True
    return shape


def _smooth(task: Task, path: Path, content: bytes, pointer: str) -> bool:
    if file_kind(content) != "obj":
        return False
    obj = read_obj(path.name, content)
    note_left_out(task.notes, path.name, obj)
    smooth = bool(bent_faces(obj).any())
    if smooth:
        detail = "Its normals are not those of its faces: it is smoothed, with newly computed normals."
        task.notes.assume(pointer, detail)
    return smooth
