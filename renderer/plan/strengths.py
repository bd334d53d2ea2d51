"""The effective scene: parts of materials without strength are removed."""

from renderer.plan.effects import TEXTURES, Color
from schemas.api.plans import LeftOut
from schemas.materials import HEIGHTS, Surface, flat_maps
from schemas.pointers import escaped
from schemas.scene import Scene


def effective(document: Scene) -> Scene:
    """The scene without maps of height 0, and with a colour for each texture that has but one.

    All decisions about a plan use this scene, so that none needs to check strengths.
    """
    changes = {name: _changes(material, document) for name, material in document.materials.items()}
    if not any(changes.values()):
        return document
    materials = {
        name: material.model_copy(update=changes[name]) if changes[name] else material
        for name, material in document.materials.items()
    }
    return document.model_copy(update={"materials": materials})


def without_strength(document: Scene, names: list[str]) -> list[LeftOut]:
    """Parts of materials that `effective` leaves out, with reasons."""
    found = []
    for name in names:
        material, pointer = document.materials[name], f"/materials/{escaped(name)}"
        for part in flat_maps(material):
            place = HEIGHTS[part] if HEIGHTS[part] in material.model_fields_set else part
            found.append(
                _left_out(f"materials.{material.type}.{part}", f"{pointer}/{place}", "its height is 0")
            )
        if _single_color(material, document) is not None:
            effect = f"textures.{document.textures[material.color_texture or ''].type}"
            found.append(_left_out(effect, f"{pointer}/color_texture", "it has one colour everywhere"))
    return found


def _changes(material: Surface, document: Scene) -> dict[str, object]:
    changes: dict[str, object] = dict.fromkeys(flat_maps(material))
    color = _single_color(material, document)
    return changes if color is None else {**changes, "color": color, "color_texture": None}


def _single_color(material: Surface, document: Scene) -> Color | None:
    """The colour of a material's texture if it is the same everywhere."""
    if material.color_texture is None:
        return None
    texture = document.textures[material.color_texture]
    single = TEXTURES[type(texture)].single
    return None if single is None else single(texture)


def _left_out(effect: str, pointer: str, reason: str) -> LeftOut:
    return LeftOut(effect=effect, pointers=(pointer,), reason=reason)
