"""Heat maps of a difference, and both pictures beside them."""

import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from accuracy.comparison.inputs import Picture
from renderer.math.arrays import Floats

Codes = NDArray[np.uint8]

WHITE_DIFFERENCE = 0.25
"""Difference of a channel, in values as seen from 0 to 1, that is shown white: no scale of one's own for each
picture, so that two maps can be compared."""

STOPS = np.array([[0, 0, 0], [90, 0, 120], [220, 40, 40], [255, 190, 20], [255, 255, 255]], np.float64)
"""Colours from no difference to `WHITE_DIFFERENCE`, perceptually even: black, violet, red, yellow, white."""

GAP_PIXELS = 4
"""Grey pixels between pictures that stand side by side."""

GREY = 128


def heat_map(image: Picture, reference: Picture) -> Codes:
    """The largest difference of the channels as seen, (H, W, 3) codes."""
    return _drawn(image, reference, _hot)


def side_by_side(image: Picture, reference: Picture) -> Codes:
    """Picture, reference and heat map from left to right, (H, 3 W + 8, 3) codes."""
    return _drawn(image, reference, _beside)


def difference(image: Picture, reference: Picture) -> Codes:
    """Perceived difference of each channel, (H, W, 3) codes: black for none, full at `WHITE_DIFFERENCE`."""
    return _drawn(
        image, reference, lambda a, b: np.rint(np.minimum(np.abs(a - b) / WHITE_DIFFERENCE, 1.0) * 255)
    )


def seen(picture: Picture) -> Codes:
    """A picture as a display shows it, (H, W, 3) codes in sRGB."""
    return _drawn(picture, picture, lambda a, _: _codes(a))


def _drawn(image: Picture, reference: Picture, draw: Callable[[Floats, Floats], NDArray[Any]]) -> Codes:
    """Draw both pictures as they are seen, band by band."""
    drawn, row = np.empty((0, 0, 3), np.uint8), 0
    for one, other in zip(image.bands(), reference.bands(), strict=True):
        part = draw(one.pixels.seen, other.pixels.seen)
        if not drawn.size:
            drawn = np.empty((image.height, *part.shape[1:]), np.uint8)
        drawn[row : row + len(part)] = part
        row += len(part)
    return drawn


def _hot(image: Floats, reference: Floats) -> Floats:
    apart = np.abs(image - reference).max(axis=2)
    place = np.minimum(apart / WHITE_DIFFERENCE, 1.0) * (len(STOPS) - 1)
    levels = np.arange(len(STOPS))
    channels = [np.interp(place, levels, STOPS[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1))


def _beside(image: Floats, reference: Floats) -> Floats:
    gap = np.full((image.shape[0], GAP_PIXELS, 3), GREY)
    return np.concatenate((_codes(image), gap, _codes(reference), gap, _hot(image, reference)), axis=1)


def _codes(values: Floats) -> Floats:
    return np.floor(values * 255 + 0.5)


def encoded(codes: Codes) -> bytes:
    """A PNG file of codes (H, W, 3)."""
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG", compress_level=4)
    return buffer.getvalue()
