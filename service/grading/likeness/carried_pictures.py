"""Textures that show the reference: a submitted scene may carry the picture that it should make."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from PIL import Image

from renderer.assets import AssetError
from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from renderer.textures.image import build
from schemas.textures import ImageTexture

SIZE = 32, 24
"""Columns and rows that pictures are reduced to: more than shapes share by chance, and no noise is left."""

ALIKE = 0.9
"""Least correlation of two reduced pictures. Among 60 pictures of the gallery, the hard cases and the ready
assignment those of different scenes have up to 0.78."""


def carried(scene: LoadedScene, reference: Floats) -> Iterator[str]:
    """Names of textures that show the reference, a linear picture (H, W, 3), in any orientation."""
    wanted = _reduced(reference)
    for name, texture in scene.document.textures.items():
        if isinstance(texture, ImageTexture):
            try:
                texels = build(texture, scene.assets).texels
            except AssetError:
                continue
            shown = _reduced(np.clip(texels, 0, 1))
            turned = (shown[::down, ::right] for down in (1, -1) for right in (1, -1))
            if max(float(np.mean(each * wanted)) for each in turned) >= ALIKE:
                yield name


def _reduced(linear: Floats) -> Floats:
    """A small picture of brightness as seen, with mean 0 and variance 1; all 0 for one colour."""
    seen = Image.fromarray(srgb_from_linear(linear).mean(axis=2).astype(np.float32))
    small = np.asarray(seen.resize(SIZE, Image.Resampling.BOX), dtype=np.float64)
    small = small - small.mean()
    deviation = small.std()
    return small / deviation if deviation > 0 else small
