"""Detection of JPEG compression: compressing a picture once more, in the same way, changes little."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats

Setting = tuple[int, int]
"""Quality and Pillow's number of the subsampling of colours."""

SETTINGS = tuple((quality, sampling) for quality in (95, 90, 85, 80, 75, 60, 50) for sampling in (0, 2))
"""Settings that are tried: common defaults, and some below."""

MOST_CHANGE = 0.5
"""Largest change of a compressed picture, relative to compressing it with its blocks moved by 4 pixels. In
the ready assignment JPEG reaches 0.4, and pictures stored without loss have 0.65 or more."""

TRIED_SIDE = 256
"""Side of the part that is tested, pixels."""


def compression(image: Floats) -> Setting | None:
    """The JPEG setting with which a linear picture (H, W, 3) was stored; None if it shows no compression."""
    part = image[:TRIED_SIDE, :TRIED_SIDE]
    if min(part.shape[:2]) < 32:
        return None
    changes = ((each, _change(part, each), _change(part[4:, 4:], each)) for each in SETTINGS)
    # A picture of one colour is never changed: that is no sign of compression.
    ratios = {each: change / moved for each, change, moved in changes if moved}
    best = min(ratios, key=ratios.__getitem__, default=None)
    return best if best is not None and ratios[best] <= MOST_CHANGE else None


def compressed(image: Floats, setting: Setting) -> Floats:
    """A linear picture (H, W, 3) after JPEG."""
    file = io.BytesIO()
    Image.fromarray(_codes(image)).save(file, "JPEG", quality=setting[0], subsampling=setting[1])
    return linear_from_srgb(np.asarray(Image.open(file)) / 255).astype(np.float64)


def _change(image: Floats, setting: Setting) -> float:
    """Mean squared change of whole blocks by JPEG, in codes."""
    high, wide = (length // 16 * 16 for length in image.shape[:2])
    whole = np.ascontiguousarray(image[:high, :wide])
    left = _codes(compressed(whole, setting)).astype(np.float64) - _codes(whole)
    return float(np.mean(left * left))


def _codes(linear: Floats) -> NDArray[np.uint8]:
    return np.rint(srgb_from_linear(linear) * 255).astype(np.uint8)
