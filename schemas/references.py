"""Names that one part of a scene uses and another part defines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from pydantic_core import InitErrorDetails, PydanticCustomError

from schemas.base import member
from schemas.pointers import Parts

Uses = Iterator[tuple[Parts, object]]


def wrong_names(scene: Mapping[str, object]) -> list[InitErrorDetails]:
    """List every use of a name that the scene does not define, or defines as something else.

    The scene may be raw: what is not even an object or a name is passed over, other checks tell about it.
    """
    return [
        *_undefined("material", used_materials(scene), scene.get("materials", {})),
        *_undefined("texture", used_textures(scene), scene.get("textures", {})),
        *_checker_normal_maps(scene),
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
        for field in ("color_texture", "normal_map"):
            yield ("materials", name, field), member(material, field)


def _undefined(kind: str, uses: Uses, defined: object) -> Iterator[InitErrorDetails]:
    if not isinstance(defined, Mapping):
        return
    message = (
        f"The scene has no {kind} of this name. Use one of the names under '{kind}s', or define it there."
    )
    error = PydanticCustomError(f"unknown_{kind}", message, {"names": tuple(defined)})
    for location, name in uses:
        if isinstance(name, str) and name not in defined:
            yield InitErrorDetails(type=error, loc=location, input=None)


def _checker_normal_maps(scene: Mapping[str, object]) -> Iterator[InitErrorDetails]:
    textures = scene.get("textures", {})
    message = "A normal map must be a texture of type 'image': the colours of a checker are no normals."
    error = PydanticCustomError("not_an_image", message)
    for location, name in used_textures(scene):
        texture = textures.get(name) if isinstance(textures, Mapping) and isinstance(name, str) else None
        if location[-1] == "normal_map" and member(texture, "type") == "checker":
            yield InitErrorDetails(type=error, loc=location, input=None)
