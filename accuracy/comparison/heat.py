"""Heat maps of a difference, and both pictures beside them."""

import io
from collections.abc import Callable
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.inputs import Picture
from renderer.images.png import write_codes

Codes = NDArray[np.uint8]
Draw = Callable[[Picture, Picture], Codes]
"""Draws two pictures; the rows of a part are those of the whole."""

WHITE_DIFFERENCE = 0.25
"""Displayed difference of a channel, 0..1, that is white: one scale for all pictures makes maps
comparable."""

COLOR_STOPS = np.array([[0, 0, 0], [90, 0, 120], [220, 40, 40], [255, 190, 20], [255, 255, 255]], np.float64)
"""Colours from no difference to `WHITE_DIFFERENCE`, perceptually even: black, violet, red, yellow, white."""

GAP_PIXELS = 4
"""Grey pixels between pictures that stand side by side."""

GAP_CODE = 128


def heat_map(image: Picture, reference: Picture) -> Codes:
    """The largest difference of the channels as seen, (H, W, 3) codes."""
    apart = np.abs(image.pixels.seen - reference.pixels.seen).max(axis=2)
    place = np.minimum(apart / WHITE_DIFFERENCE, 1.0) * (len(COLOR_STOPS) - 1)
    levels = np.arange(len(COLOR_STOPS))
    channels = [np.interp(place, levels, COLOR_STOPS[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def side_by_side(image: Picture, reference: Picture) -> Codes:
    """Picture, reference and heat map from left to right, (H, 3 W + 8, 3) codes."""
    gap = np.full((image.height, GAP_PIXELS, 3), GAP_CODE, np.uint8)
    return np.concatenate(
        (seen(image), gap, seen(reference), gap, heat_map(image, reference)), axis=1, dtype=np.uint8
    )


def difference(image: Picture, reference: Picture) -> Codes:
    """Perceived difference of each channel, (H, W, 3) codes: black for none, full at `WHITE_DIFFERENCE`."""
    apart = np.abs(image.pixels.seen - reference.pixels.seen)
    return np.rint(np.minimum(apart / WHITE_DIFFERENCE, 1.0) * 255).astype(np.uint8)


def seen(picture: Picture) -> Codes:
    """A picture as a display shows it, (H, W, 3) codes in sRGB."""
    return np.floor(picture.pixels.seen * 255 + 0.5).astype(np.uint8)


def encoded(draw: Draw, image: Picture, reference: Picture) -> bytes:
    """A PNG file of two pictures, drawn in bands: the whole drawing may be far larger than both."""
    parts = (draw(one, other) for one, other in zip(image.bands(), reference.bands(), strict=True))
    first, file = next(parts), io.BytesIO()
    write_codes(file, (image.height, first.shape[1]), chain((first,), parts))
    return file.getvalue()
