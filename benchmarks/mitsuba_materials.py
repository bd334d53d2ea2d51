"""Materials as the peer's integrator reads them: tables by shape, and image textures of the peer's own.

Choose the variant of Mitsuba before importing this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image

from schemas.textures import CheckerTexture, ImageTexture

if TYPE_CHECKING:
    from pathlib import Path

    from schemas.materials import PhongMaterial
    from schemas.scene import Scene

_Color: TypeAlias = tuple[float, float, float]

_FIELDS = ("ambient", "diffuse", "specular", "shininess")
_BENT = ("bump_map", "displacement_map", "mirror", "transmission")
"""Fields of a material that the peer does not know."""


@dataclass(frozen=True)
class ImageMap:
    """An image, and for each shape whether it shows it."""

    used: Any
    texture: Any

    def at(self, uv: Any) -> Any:
        """Look the image up where row 0 of the file is on the side v = 1."""
        return mi.Color3f(*self.texture.eval(mi.Point2f(uv.x, 1 - uv.y)))


@dataclass(frozen=True)
class Materials:
    """Tables with one row a shape, and the images that take the place of colours and normals."""

    rows: dict[str, Any]
    colors: list[ImageMap]
    normals: list[ImageMap]


def materials_of(scene: Scene, folder: Path) -> Materials:
    """Form the tables of a scene whose images are in `folder`."""
    used = [scene.materials[shape.material] for shape in scene.shapes]
    if any(getattr(material, field) for material in used for field in _BENT):
        raise ValueError("the peer's surfaces are neither moved nor mirrors nor glass")
    rows = {field: mi.Float([getattr(material, field) for material in used]) for field in _FIELDS}
    return Materials(
        rows=rows | _color_rows([_squares(scene, material) for material in used]),
        colors=_maps(scene, folder, [material.color_texture for material in used], stored=False),
        normals=_maps(scene, folder, [material.normal_map for material in used], stored=True),
    )


def _squares(scene: Scene, material: PhongMaterial) -> tuple[_Color, _Color, tuple[float, float]]:
    texture = scene.textures.get(material.color_texture or "")
    if isinstance(texture, CheckerTexture):
        if texture.filter != "none":
            raise ValueError("the peer's checker has no filter")
        return texture.even, texture.odd, texture.repeat
    color = material.color or (1.0, 1.0, 1.0)
    return color, color, (1.0, 1.0)


def _color_rows(squares: list[tuple[_Color, _Color, tuple[float, float]]]) -> dict[str, Any]:
    even, odd, repeat = (np.array(column).T for column in zip(*squares, strict=True))
    if np.array_equal(even, odd):
        return {"color": mi.Color3f(even)}
    return {"color": mi.Color3f(even), "odd": mi.Color3f(odd), "repeat": mi.Vector2f(repeat)}


def _maps(scene: Scene, folder: Path, names: list[str | None], *, stored: bool) -> list[ImageMap]:
    images = {name: scene.textures[name] for name in dict.fromkeys(names) if name is not None}
    return [
        ImageMap(mi.Bool([name == other for other in names]), _texture(image, folder, stored=stored))
        for name, image in images.items()
        if isinstance(image, ImageTexture)
    ]


def _texture(image: ImageTexture, folder: Path, *, stored: bool) -> Any:
    if (image.filter, image.wrap) != ("bilinear", "repeat"):
        raise ValueError("the peer's images are bilinear and repeat themselves")
    with Image.open(folder / image.asset) as file:
        values = np.asarray(file.convert("RGB"), dtype=np.float64) / 255
    if image.encoding == "srgb" and not stored:
        # IEC 61966-2-1: a line below 0.04045, a power of 2.4 above.
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    modes = {"filter_mode": dr.FilterMode.Linear, "wrap_mode": dr.WrapMode.Repeat}
    return mi.Texture2f(mi.TensorXf(values.astype(np.float32)), use_accel=False, **modes)
