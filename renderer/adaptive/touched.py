"""Pixels that small and thin shapes may touch through a lens: the nodes of a lattice may miss them."""

from collections.abc import Iterable

import numpy as np

from renderer.adaptive.neighbours import spread
from renderer.adaptive.outlines import outline_of, thin_places
from renderer.adaptive.thin import along, on_picture, profile, spans
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks
from renderer.shapes import Family
from renderer.shapes.family import Hulls


def touched_places(camera: Pinhole, families: Iterable[Family], within: int) -> Integers:
    """Pixels (2, N) that parts of shapes may touch that are narrower than twice `within`, with their blur.

    What is blurred more widely is found by nodes that are so many pixels apart.
    """
    found = np.zeros((camera.height, camera.width), dtype=bool)
    for family in families:
        hulls = family.hulls()
        if hulls.edges:
            places = thin_places(camera, outline_of(family, camera.position), within)
            _mark(found, places.pixels, blur(camera, places.depths), within)
        else:
            _mark_curved(found, camera, hulls, within)
    rows, columns = np.nonzero(found)
    return np.stack((columns, rows))


def blur(camera: Pinhole, depths: Floats) -> Floats:
    """Blur radius at given depths, pixels."""
    return camera.blur(depths) / depths * (camera.height / (2 * camera.half_height))


def _mark(found: Masks, pixels: Integers, reach: Floats, most: float) -> None:
    """Mark what is within the reach (N,) of pixels (2, N), if that is not too far."""
    height, width = found.shape
    inside = (pixels >= 0).all(axis=0) & (pixels[0] < width) & (pixels[1] < height) & (reach < most)
    pixels, whole = pixels[:, inside], np.ceil(reach[inside]).astype(np.int64)
    for size in np.unique(whole).tolist():
        marks = np.zeros_like(found)
        marks[pixels[1, whole == size], pixels[0, whole == size]] = True
        found |= spread(marks, size)


def _mark_curved(found: Masks, camera: Pinhole, hulls: Hulls, within: int) -> None:
    """The same for curved shapes; the tips of drawn-out ellipses are narrow, too."""
    x, y, depth, ahead = on_picture(camera, hulls.corners)
    measured = spans(x, y)
    widths, lengths = measured.min(axis=0), measured.max(axis=0)
    long = lengths > 2 * widths
    # What is about as wide as long is marked from its middle.
    compact = np.flatnonzero(ahead & ~long & (lengths < 2 * within))
    middles = np.stack((x[:, compact].mean(axis=0), y[:, compact].mean(axis=0)))
    reach = lengths[compact] / 2 + blur(camera, depth[:, compact].mean(axis=0))
    _mark(found, np.floor(middles).astype(np.int64), reach, within)
    for shape in np.flatnonzero(ahead & long).tolist():
        places = along(x[:, shape], y[:, shape], 1 / depth[:, shape])
        half = profile(hulls, places.shape[1]) / 2 * widths[shape]
        _mark(found, np.floor(places[:2]).astype(np.int64), half + blur(camera, 1 / places[2]), within)
