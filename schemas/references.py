"""Names that one part of a scene uses and another part defines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from pydantic_core import InitErrorDetails, PydanticCustomError

from schemas.base import member
from schemas.pointers import Parts
from schemas.quantities import LONGEST_NAME

MAPS = {
    "normal_map": "A normal map must be a texture of type 'image': a checker's colours are no normals.",
    "bump_map": "A bump map must be a texture of type 'image': a checker has no slopes.",
    "displacement_map": "A displacement map must be a texture of type 'image': a checker has no slopes.",
}
"""Fields of a material that take an image alone, and why."""

Uses = Iterator[tuple[Parts, object]]


def wrong_names(scene: Mapping[str, object]) -> list[InitErrorDetails]:
    """List every name that the scene uses and does not define, or defines as something else.

    The scene may be raw: what is not even an object or a name is passed over, other checks tell about it.
    """
    return [
        *_undefined("material", used_materials(scene), scene.get("materials", {})),
        *_undefined("texture", used_textures(scene), scene.get("textures", {})),
        *_checker_maps(scene),
        *_unknown_vertices(scene),
    ]


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
    places: dict[str, list[Parts]] = {}
    for location, name in uses:
        if isinstance(name, str) and 0 < len(name) <= LONGEST_NAME and name not in defined:
            places.setdefault(name, []).append(location)
    for location, *others in places.values():
        message = (
            f"The scene has no {kind} of this name. Use one of the names under '{kind}s', or define it "
            f"there.{also_named(len(others))}"
        )
        error = PydanticCustomError(f"unknown_{kind}", message, {"names": tuple(defined)})
        yield InitErrorDetails(type=error, loc=location, input=None)


def also_named(others: int) -> str:
    """A sentence about other places where the same name stands; nothing where there are none.

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
