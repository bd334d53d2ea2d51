"""The scene as a user writes it: its parts, and the names by which they refer to each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from itertools import chain, islice
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from schemas.base import Closed, member
from schemas.cameras import Camera
from schemas.errors import BUILT_IN
from schemas.lights import Light
from schemas.limits import refuse_above
from schemas.materials import Material
from schemas.pointers import Parts
from schemas.quality import Sampling
from schemas.quantities import LONGEST_NAME, Color, Name, whole
from schemas.shapes import Shape
from schemas.textures import Texture

Stops = Annotated[float, Field(strict=True, ge=-100, le=100, allow_inf_nan=False)]


class Display(Closed):
    """Conversion of linear values to a PNG. Linear files (.npy) ignore it."""

    transfer: Literal["srgb", "linear"] = Field(
        default="srgb", description="`srgb` for viewing, `linear` for measuring."
    )
    exposure: Stops = Field(
        default=0.0, description="Stops, -100 to 100: radiance is multiplied by 2 ** exposure first."
    )


MAPS = {
    "normal_map": "A normal map must be a texture of type 'image': a checker's colours are no normals.",
    "bump_map": "A bump map must be a texture of type 'image': a checker has no slopes.",
    "displacement_map": "A displacement map must be a texture of type 'image': a checker has no slopes.",
}
"""Fields of a material that take an image alone, and why."""

Uses = Iterator[tuple[Parts, object]]


def wrong_names(scene: Mapping[str, object]) -> list[InitErrorDetails]:
    """List the names that the scene uses and does not define, or defines as something else: the first 1000.

    The scene may be raw: what is not even an object or a name is skipped, other checks report it.
    """
    wrong = (
        _undefined("material", used_materials(scene), scene.get("materials", {})),
        _undefined("texture", used_textures(scene), scene.get("textures", {})),
        _checker_maps(scene),
        _unknown_vertices(scene),
    )
    return [*islice(chain.from_iterable(wrong), _MAX_ERRORS)]


def used_materials(scene: Mapping[str, object]) -> Uses:
    """Give the location and the value of every field that names a material."""
    shapes = scene.get("shapes", ())
    for index, shape in enumerate(shapes if isinstance(shapes, list | tuple) else ()):
        yield ("shapes", index, "material"), member(shape, "material")


def used_textures(scene: Mapping[str, object]) -> Uses:
    """Give the location and the value of every field that names a texture."""
    materials = scene.get("materials", {})
    for name, material in materials.items() if isinstance(materials, Mapping) else ():
        for field in ("color_texture", *MAPS):
            yield ("materials", name, field), member(material, field)


def _undefined(kind: str, uses: Uses, defined: object) -> Iterator[InitErrorDetails]:
    """The first use of each name that is not defined: one definition mends them all."""
    if not isinstance(defined, Mapping):
        return
    locations_of: dict[str, list[Parts]] = {}
    for location, name in uses:
        if isinstance(name, str) and 0 < len(name) <= LONGEST_NAME and name not in defined:
            locations_of.setdefault(name, []).append(location)
    for location, *others in locations_of.values():
        message = (
            f"The scene has no {kind} of this name. Use one of the names under '{kind}s', or define it "
            f"there.{also_named(len(others))}"
        )
        error = PydanticCustomError(f"unknown_{kind}", message)
        yield InitErrorDetails(type=error, loc=location, input=None)


def also_named(others: int) -> str:
    """A sentence about other uses of the same name; empty if there are none.

    >>> also_named(2)
    ' 2 other places name it too.'
    """
    if not others:
        return ""
    return f" {others} other places name it too." if others > 1 else " 1 other place names it too."


def _checker_maps(scene: Mapping[str, object]) -> Iterator[InitErrorDetails]:
    textures = scene.get("textures", {})
    for location, name in used_textures(scene):
        texture = textures.get(name) if isinstance(textures, Mapping) and isinstance(name, str) else None
        message = MAPS.get(str(location[-1]))
        if message and member(texture, "type") == "checker":
            error = PydanticCustomError("not_an_image", message)
            yield InitErrorDetails(type=error, loc=location, input=None)


def _unknown_vertices(scene: Mapping[str, object]) -> Iterator[InitErrorDetails]:
    """The first vertex number of each mesh that goes beyond its vertices."""
    shapes = scene.get("shapes", ())
    for index, shape in enumerate(shapes if isinstance(shapes, list | tuple) else ()):
        vertices, triangles = member(shape, "vertices"), member(shape, "triangles")
        # Where there are no vertices at all, that is the mistake.
        if isinstance(vertices, list | tuple) and vertices and isinstance(triangles, list | tuple):
            place = _beyond(triangles, len(vertices))
            if place is not None:
                message = "There is no such vertex: the mesh has {count}, numbered from 0 to {last}."
                numbers = {"count": len(vertices), "last": len(vertices) - 1}
                error = PydanticCustomError("no_such_vertex", message, numbers)
                yield InitErrorDetails(type=error, loc=("shapes", index, "triangles", *place), input=None)


def _beyond(triangles: Sequence[object], count: int) -> tuple[int, int] | None:
    for row, triangle in enumerate(triangles):
        for corner, vertex in enumerate(triangle if isinstance(triangle, list | tuple) else ()):
            if isinstance(vertex, int) and vertex >= count:
                return row, corner
    return None


# An error takes microseconds and kilobytes. Beyond so many, wrong names wait for the next try.
_MAX_ERRORS = 1000

BLACK = (0.0, 0.0, 0.0)


def _number(version: Any) -> Any:
    # A literal 1 would take True, which equals it.
    number = whole(version)
    if type(number) is not int:
        raise PydanticCustomError("not_a_choice", "This must be 1, without quotes.")
    return number


class Scene(Closed):
    """A scene: camera, shapes, lights, and how they are sampled and displayed."""

    version: Annotated[Literal[1], BeforeValidator(_number)] = Field(
        description="The version of the scene language: 1."
    )
    name: Name | None = Field(default=None, description="A name for people; it changes nothing.")
    camera: Camera = Field(description="The camera.")
    background: Color = Field(default=BLACK, description="Linear RGB where a camera ray hits nothing.")
    ambient: Color = Field(
        default=BLACK, description="Linear RGB of light from all directions; none by default."
    )
    textures: dict[Name, Texture] = Field(default_factory=dict, description="Textures by name.")
    materials: dict[Name, Material] = Field(default_factory=dict, description="Materials by name.")
    shapes: tuple[Shape, ...] = Field(
        default=(),
        description="What is seen, and what casts shadows. Where flat shapes overlap in one plane, or "
        "ellipsoids coincide, the first is seen.",
    )
    lights: tuple[Light, ...] = Field(default=(), description="The lights.")
    sampling: Sampling = Field(default_factory=Sampling, description="How many samples, and where.")
    display: Display = Field(default_factory=Display, description="How a PNG is encoded.")

    @field_validator("shapes", "lights", "materials", "textures", mode="before")
    @classmethod
    def _not_too_many(cls, items: Any, info: ValidationInfo) -> Any:
        if isinstance(items, Sized):
            refuse_above(len(items), info, f"max_{info.field_name}", f"{info.field_name} in one scene")
        return items

    @model_validator(mode="wrap")
    @classmethod
    def _names_defined(cls, scene: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        # Names are checked on the raw scene, so that a wrong number elsewhere does not hide a wrong name.
        wrong = wrong_names(scene) if isinstance(scene, Mapping) else []
        try:
            checked = handler(scene)
        except ValidationError as error:
            if not wrong or error.error_count() > _MAX_ERRORS:
                raise
            wrong = [*map(_again, error.errors(include_url=False)), *wrong]
        if wrong:
            raise ValidationError.from_exception_data(cls.__name__, wrong, hide_input=True)
        return checked


def _again(error: ErrorDetails) -> InitErrorDetails:
    """Make an error that can be raised together with others."""
    kind, context = error["type"], error.get("ctx", {})
    made = kind if kind in BUILT_IN else PydanticCustomError(kind, error["msg"], context)
    return InitErrorDetails(type=made, loc=error["loc"], input=error["input"], ctx=context)
