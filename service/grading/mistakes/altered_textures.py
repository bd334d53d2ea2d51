"""Textures read wrongly: flipped, or with another encoding."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError, AssetSource
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.images.png import write_codes
from renderer.images.portable import encode_pfm
from renderer.images.reading import read_image
from renderer.scenes import LoadedScene
from schemas.textures import ImageTexture

Texels = NDArray[Any]
"""Stored numbers, (H, W, 3) float in 0..1, row 0 on top."""

Change = Callable[[Texels], Texels]

SUFFIX = "#altered"
"""Added to the name of a changed file; no asset of a scene has such a name."""


@dataclass(frozen=True, slots=True, eq=False)
class AlteredAssets:
    """Assets that change marked files as they are read.

    Attributes
    ----------
    source : AssetSource
    change : callable
        Maps stored texels (H, W, 3) in 0..1 to changed ones.
    """

    source: AssetSource
    change: Change

    def read(self, name: str) -> bytes:
        """Content of a file; KeyError if it does not exist."""
        if not name.endswith(SUFFIX):
            return self.source.read(name)
        found = read_image(self.source.read(name.removesuffix(SUFFIX)))
        # Light of a normal map may be below 0, where codes have no meaning.
        with np.errstate(invalid="ignore"):
            texels = np.nan_to_num(self.change(found.values))
        return encode_pfm(texels) if found.floating else _in_sixteen_bits(texels)


def _in_sixteen_bits(texels: Texels) -> bytes:
    file = io.BytesIO()
    codes = np.round(65535 * np.clip(texels, 0, 1)).astype(np.uint16)
    write_codes(file, codes.shape[:2], [codes], bits=16)
    return file.getvalue()


def _green(texels: Texels) -> Texels:
    changed = texels.copy()
    changed[:, :, 1] = 1 - changed[:, :, 1]
    return changed


ORIENTATIONS: dict[str, Change] = {
    "texture_upside_down": lambda texels: texels[::-1],
    "texture_mirrored": lambda texels: texels[:, ::-1],
    "texture_turned": lambda texels: texels[::-1, ::-1],
    "texture_transposed": lambda texels: texels[::-1].transpose(1, 0, 2)[::-1],
}
COLORS: dict[str, Change] = ORIENTATIONS | {
    "texture_not_decoded": srgb_from_linear,
    "texture_decoded_twice": linear_from_srgb,
}
NORMALS: dict[str, Change] = ORIENTATIONS | {
    "normal_map_decoded": linear_from_srgb,
    "normal_map_green": _green,
    "normal_map_swapped": lambda texels: texels[:, :, [1, 0, 2]],
    "normal_map_not_shifted": lambda texels: (texels + 1) / 2,
}


def altered_textures(scene: LoadedScene) -> Iterator[tuple[str, LoadedScene]]:
    """The scene with its textures read wrongly, once for each cause."""
    materials = scene.document.materials.values()
    colors = {material.color_texture for material in materials if material.color_texture}
    maps = {material.normal_map for material in materials if material.normal_map}
    for names, changes in ((colors, COLORS), (maps, NORMALS)):
        textures = {name: scene.document.textures[name] for name in names}
        images = {name: each for name, each in textures.items() if isinstance(each, ImageTexture)}
        for cause, change in changes.items() if images and _readable(scene, images) else ():
            yield cause, _changed(scene, images, change)


def _readable(scene: LoadedScene, images: Mapping[str, ImageTexture]) -> bool:
    """Whether all files are readable pictures."""
    try:
        for texture in images.values():
            read_image(scene.assets.read(texture.asset))
    except (AssetError, KeyError):
        return False
    return True


def _changed(scene: LoadedScene, images: Mapping[str, ImageTexture], change: Change) -> LoadedScene:
    altered = {name: each.model_copy(update={"asset": each.asset + SUFFIX}) for name, each in images.items()}
    document = scene.document.model_copy(update={"textures": {**scene.document.textures, **altered}})
    return LoadedScene(document, AlteredAssets(scene.assets, change))
