"""Detection of lossy formats: JPEG and WebP by storing a picture again, palettes by their few colours."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image, features

from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats

Setting = tuple[str, int, int]
"""Format, quality and Pillow's number of the subsampling of colours, which is fixed in WebP."""

SETTINGS: tuple[Setting, ...] = (
    *(("JPEG", quality, sampling) for quality in (95, 90, 85, 80, 75, 60, 50) for sampling in (0, 2)),
    *(("WEBP", quality, 2) for quality in (95, 90, 80, 75, 50) if features.check("webp")),
)
"""Settings that are tried: common defaults, and some below."""

MOVED = 5
"""Pixels by which blocks are moved: a multiple of the 4 of WebP would leave most of them in place."""

MOST_CHANGE = 0.5
"""Largest change of a compressed picture, relative to compressing it with its blocks moved. In the ready
assignment JPEG reaches 0.27, WebP 0.5, and pictures stored without loss have 0.71 or more."""

PALETTE = range(33, 257)
"""Colours of a picture with a palette. Edges of flat shapes have few of their own."""

MORE_COLORS = 1.5
"""Least number of colours of a reference that has no palette, over those of the largest one."""

TRIED_SIDE = 256
"""Side of the part that is tested, pixels."""


def compression(image: Floats) -> Setting | None:
    """The setting with which a linear picture (H, W, 3) was stored; None if it shows no compression."""
    part = image[:TRIED_SIDE, :TRIED_SIDE]
    if min(part.shape[:2]) < 32:
        return None
    changes = ((each, _change(part, each), _change(part[MOVED:, MOVED:], each)) for each in SETTINGS)
    # A picture of one colour is never changed: that is no sign of compression.
    ratios = {each: change / moved for each, change, moved in changes if moved}
    best = min(ratios, key=ratios.__getitem__, default=None)
    return best if best is not None and ratios[best] <= MOST_CHANGE else None


def compressed(image: Floats, setting: Setting) -> Floats:
    """A linear picture (H, W, 3) after compression."""
    file = io.BytesIO()
    Image.fromarray(_codes(image)).save(file, setting[0], quality=setting[1], subsampling=setting[2])
    return linear_from_srgb(np.asarray(Image.open(file)) / 255).astype(np.float64)


def palette(image: Floats, reference: Floats) -> tuple[int, int] | None:
    """Colours of linear pictures (H, W, 3), if those of the first look like those of a palette."""
    few = _colors(image)
    if few not in PALETTE or (more := _colors(reference)) < MORE_COLORS * PALETTE[-1]:
        return None
    return few, more


def _colors(image: Floats) -> int:
    return len(np.unique(_codes(image) @ np.array([1 << 16, 1 << 8, 1])))


def _change(image: Floats, setting: Setting) -> float:
    """Mean squared change of whole blocks, in codes."""
    high, wide = (length // 16 * 16 for length in image.shape[:2])
    whole = np.ascontiguousarray(image[:high, :wide])
    left = _codes(compressed(whole, setting)).astype(np.float64) - _codes(whole)
    return float(np.mean(left * left))


def _codes(linear: Floats) -> NDArray[np.uint8]:
    return np.rint(srgb_from_linear(linear) * 255).astype(np.uint8)
