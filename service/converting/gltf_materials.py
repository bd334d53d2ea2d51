"""Convert glTF's metal and roughness to Phong materials of a scene."""

from __future__ import annotations

from typing import Any

from renderer.images.reading import image_size
from service.converting.gltf_document import Material, TextureUse, pick
from service.converting.gltf_geometry import Buffers
from service.converting.task import UNUSABLE_FILE_ERRORS, named_texture

DIELECTRIC_REFLECTANCE = 0.04
"""Share that a surface of refractive index 1.5 reflects straight back: the specular colour that glTF gives
to everything that is no metal."""
MIN_ROUGHNESS = 0.1
"""Least roughness: a highlight of one degree. Smoother surfaces would be mirrors."""

_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_NEAREST = 9728


class GltfMaterials:
    """Turns materials of a document into those of one scene.

    Parameters
    ----------
    buffers
        The document's numbers and pictures.
    textures
        The scene's textures; they are added here.
    """

    def __init__(self, buffers: Buffers, textures: dict[str, Any]) -> None:
        self.buffers = buffers
        self.notes = buffers.task.notes
        self.textures = textures
        self.assets: dict[int, str | None] = {}

    def convert(self, number: int) -> dict[str, Any]:
        """One material.

        Raises
        ------
        ConversionError
            It, or what it names, is not there.
        """
        material = pick(self.buffers.name, self.buffers.document.materials, number, "/meshes")
        place = f"/materials/{number}"
        made: dict[str, Any] = {"type": "phong"}
        self._color(material, place, made)
        made |= highlight(material.pbr.roughness_factor)
        self.notes.assume(
            f"{place}/pbrMetallicRoughness",
            "Roughness becomes a Phong highlight as bright and as wide in the middle.",
        )
        if material.pbr.metallic_factor > 0:
            self.notes.assume(
                f"{place}/pbrMetallicRoughness",
                "Metal is shown in its colour, with a white highlight and no reflections: set mirror for "
                "those.",
            )
        self._relief(material, place, made)
        self._glass(material, place, made)
        if material.alpha_mode != "OPAQUE":
            self.notes.leave_out(f"{place}/alphaMode", "All surfaces are opaque: alpha is left out.")
        return made

    def _color(self, material: Material, place: str, made: dict[str, Any]) -> None:
        factor = material.pbr.base_color_factor[:3]
        use = material.pbr.base_color_texture
        texture = self._texture(use, f"{place}/pbrMetallicRoughness/baseColorTexture", "srgb")
        if texture is None:
            made["color"] = list(factor)
            return
        made["color_texture"] = texture
        if factor != (1, 1, 1):
            made["diffuse"] = sum(factor) / 3
            if len(set(factor)) > 1:
                self.notes.assume(
                    f"{place}/pbrMetallicRoughness/baseColorFactor",
                    "The texture is multiplied by the mean of the factor.",
                )

    def _relief(self, material: Material, place: str, made: dict[str, Any]) -> None:
        use = material.normal_texture
        texture = self._texture(use, f"{place}/normalTexture", "linear")
        if texture is not None and use is not None:
            made["normal_map"] = texture
            if use.scale != 1:
                detail = "The normal map is used as stored: its scale is left out."
                self.notes.leave_out(f"{place}/normalTexture/scale", detail)

    def _glass(self, material: Material, place: str, made: dict[str, Any]) -> None:
        glass = material.extensions.transmission
        if glass is not None and glass.transmission_factor > 0:
            share = glass.transmission_factor
            made |= {"transmission": share, "ior": material.extensions.refraction.ior}
            made["diffuse"] = made.get("diffuse", 1.0) * (1 - share)
            self.notes.assume(
                f"{place}/extensions/KHR_materials_transmission",
                "It is clear glass, without a colour.",
            )

    def _texture(self, use: TextureUse | None, pointer: str, encoding: str) -> str | None:
        if use is None:
            return None
        document, name = self.buffers.document, self.buffers.name
        texture = pick(name, document.textures, use.index, f"{pointer}/index")
        if use.tex_coord != 0:
            self.notes.leave_out(f"{pointer}/texCoord", "The first set of texture coordinates is used.")
        asset = (
            None if texture.source is None else self._asset(texture.source, f"/textures/{use.index}/source")
        )
        if asset is None:
            return None
        made: dict[str, Any] = {"type": "image", "asset": asset, "encoding": encoding, "wrap": "repeat"}
        if texture.sampler is not None:
            place = f"/textures/{use.index}/sampler"
            sampler = pick(name, document.samplers, texture.sampler, place)
            made["wrap"] = _WRAPS.get(sampler.wrap_s, "repeat")
            if sampler.wrap_s != sampler.wrap_t:
                self.notes.assume(f"/samplers/{texture.sampler}", "Both directions wrap as wrapS says.")
            if sampler.mag_filter == _NEAREST:
                made["filter"] = "nearest"
        return named_texture(self.textures, made)

    def _asset(self, number: int, pointer: str) -> str | None:
        """The scene's name of a picture; None, with a note, where it cannot be used."""
        if number not in self.assets:
            image = pick(self.buffers.name, self.buffers.document.images, number, pointer)
            try:
                stem, ending, content = self.buffers.picture(image, number)
                image_size(content)
                self.assets[number] = self.buffers.task.placed.make(stem, ending, content)
            except (*UNUSABLE_FILE_ERRORS, ValueError) as error:
                self.notes.leave_out(f"/images/{number}", f"The picture is left out. {error}")
                self.assets[number] = None
        return self.assets[number]


def highlight(roughness: float) -> dict[str, float]:
    """Strength and shininess of a Phong highlight for a roughness of glTF.

    Normals spread by alpha = roughness^2 are those of an exponent 2 / alpha^2 - 2 about the half vector
    (Walter and others 2007, section 5.2), a quarter of which holds about the reflected ray. A lobe of
    exponent n that gives back the share k of the light is k (n + 2) / 2 high where diffuse white is 1; 1 is
    the most.

    >>> highlight(1.0)
    {'specular': 0.04, 'shininess': 0.0}
    """
    alpha = max(roughness, MIN_ROUGHNESS) ** 2
    shininess = (2 / alpha**2 - 2) / 4
    return {"specular": min(1.0, DIELECTRIC_REFLECTANCE * (shininess + 2) / 2), "shininess": shininess}
