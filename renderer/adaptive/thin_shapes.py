"""Pixels that small and thin shapes may touch: nodes of a lattice may miss these, with a lens or without."""

from collections.abc import Iterable

import numpy as np

from renderer.adaptive.edges import outline_of, thin_positions, view_from
from renderer.adaptive.neighbourhoods import dilate
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks
from renderer.shapes import Family
from renderer.shapes.family import Hulls

DIRECTIONS = 16
"""Directions over half a turn in which widths on the picture are measured: the least is 2 % too large."""

MAX_POSITIONS = 65536
"""Most positions along a shape, however far it reaches beyond the picture."""


def thin_pixels(camera: Pinhole, families: Iterable[Family], within: int) -> Integers:
    """Pixels (2, N) that parts of shapes narrower than twice `within` may touch, their blur included.

    Parts that are blurred more widely are found by nodes that are `within` pixels apart.
    """
    found = np.zeros((camera.height, camera.width), dtype=bool)
    for family in families:
        hulls = family.hulls()
        if hulls.edges:
            positions = thin_positions(camera, outline_of(family, camera.position), within)
            _mark(found, positions.pixels, _blur(camera, positions.depths), within)
        else:
            _mark_curved(found, camera, hulls, within)
    rows, columns = np.nonzero(found)
    return np.stack((columns, rows))


def _blur(camera: Pinhole, depths: Floats) -> Floats:
    """Blur radius at given depths, pixels."""
    return camera.blur(depths) / depths * (camera.height / (2 * camera.half_height))


def _mark(found: Masks, pixels: Integers, reach: Floats, most: float) -> None:
    """Mark pixels within the reach (N,) of pixels (2, N), where it is below `most`."""
    height, width = found.shape
    inside = (pixels >= 0).all(axis=0) & (pixels[0] < width) & (pixels[1] < height) & (reach < most)
    pixels, whole = pixels[:, inside], np.ceil(reach[inside]).astype(np.int64)
    for size in np.unique(whole).tolist():
        marks = np.zeros_like(found)
        marks[pixels[1, whole == size], pixels[0, whole == size]] = True
        found |= dilate(marks, size)


def _mark_curved(found: Masks, camera: Pinhole, hulls: Hulls, within: int) -> None:
    """Mark pixels that curved shapes may touch where they are narrow, as at the tips of long ellipses."""
    seen = view_from(camera, np.hstack([*hulls.corners])).reshape(3, len(hulls.corners), -1)
    ahead = (seen[2] > 0).all(axis=0)
    depth = np.where(seen[2] > 0, seen[2], 1.0)
    x, y = (seen[0] / depth + 1) / 2 * camera.width, (1 - seen[1] / depth) / 2 * camera.height
    measured = _spans(x, y)
    widths, lengths = measured.min(axis=0), measured.max(axis=0)
    long = lengths > 2 * widths
    # Compact shapes are marked from their centre.
    compact = np.flatnonzero(ahead & ~long & (lengths < 2 * within))
    middles = np.stack((x[:, compact].mean(axis=0), y[:, compact].mean(axis=0)))
    reach = lengths[compact] / 2 + _blur(camera, depth[:, compact].mean(axis=0))
    _mark(found, np.floor(middles).astype(np.int64), reach, within)
    for shape in np.flatnonzero(ahead & long).tolist():
        positions = _along(x[:, shape], y[:, shape], 1 / depth[:, shape])
        half = _profile(hulls, positions.shape[1]) / 2 * widths[shape]
        _mark(found, np.floor(positions[:2]).astype(np.int64), half + _blur(camera, 1 / positions[2]), within)


def _profile(hulls: Hulls, count: int) -> Floats:
    """Relative width of curved shapes at `count` positions from end to end.

    2 sqrt(s (1 - s)) at a share s of an ellipse's length, and 1 for other shapes.
    """
    share = np.linspace(0, 1, count)
    return 2 * np.sqrt(share * (1 - share)) if hulls.round else np.ones(count)


def _spans(x: Floats, y: Floats) -> Floats:
    """Width of each hull on the picture in some directions, (DIRECTIONS, K), pixels."""
    turns = np.arange(DIRECTIONS) * (np.pi / DIRECTIONS)
    along = np.cos(turns)[:, None, None] * x + np.sin(turns)[:, None, None] * y
    return np.ptp(along, axis=1)


def _along(x: Floats, y: Floats, *more: Floats) -> Floats:
    """Positions (2, n), at most a pixel apart, along the axis of a hull's corners (V,) from end to end.

    Further attributes of the corners are interpolated into further rows.
    """
    away = np.hypot(x[:, None] - x, y[:, None] - y)
    first, second = np.unravel_index(np.argmax(away), away.shape)
    order = np.argsort((x - x[first]) * (x[second] - x[first]) + (y - y[first]) * (y[second] - y[first]))
    half = x.size // 2
    ends = [(values[order[:half]].mean(), values[order[-half:]].mean()) for values in (x, y, *more)]
    steps = np.linspace(0, 1, min(int(away.max()) + 2, MAX_POSITIONS))
    return np.stack([start + steps * (end - start) for start, end in ends])
