"""Heat maps of a difference, and both pictures beside them."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats

HOTTEST = 0.25
"""Difference of a channel, in values as seen from 0 to 1, that is shown white: no scale of one's own for each
picture, so that two maps can be compared."""

STOPS = np.array([[0, 0, 0], [90, 0, 120], [220, 40, 40], [255, 190, 20], [255, 255, 255]], np.float64)
"""Colours from no difference to `HOTTEST`, in perceptually even steps: black, violet, red, yellow, white."""

GAP = 4
"""Grey pixels between pictures that stand side by side."""

GREY = 128


def heat_map(image: Floats, reference: Floats) -> NDArray[np.uint8]:
    """The largest difference of the channels as seen, (H, W, 3) codes, of two linear pictures 0..1."""
    apart = np.abs(srgb_from_linear(image) - srgb_from_linear(reference)).max(axis=2)
    place = np.minimum(apart / HOTTEST, 1.0) * (len(STOPS) - 1)
    levels = np.arange(len(STOPS))
    channels = [np.interp(place, levels, STOPS[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def side_by_side(image: Floats, reference: Floats) -> NDArray[np.uint8]:
    """Picture, reference and heat map from left to right, (H, 3 W + 8, 3) codes."""
    gap = np.full((image.shape[0], GAP, 3), GREY, np.uint8)
    return np.concatenate((seen(image), gap, seen(reference), gap, heat_map(image, reference)), axis=1)


def difference(image: Floats, reference: Floats) -> NDArray[np.uint8]:
    """Perceived difference of each channel, (H, W, 3) codes: black for none, full at `HOTTEST`."""
    apart = np.abs(srgb_from_linear(image) - srgb_from_linear(reference))
    return np.rint(np.minimum(apart / HOTTEST, 1.0) * 255).astype(np.uint8)


def encoded(codes: NDArray[np.uint8]) -> bytes:
    """A PNG file of codes (H, W, 3)."""
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG", compress_level=4)
    return buffer.getvalue()


def seen(linear: Floats) -> NDArray[np.uint8]:
    """A linear picture 0..1 as a display shows it, (H, W, 3) codes in sRGB."""
    return np.floor(srgb_from_linear(linear) * 255 + 0.5).astype(np.uint8)
