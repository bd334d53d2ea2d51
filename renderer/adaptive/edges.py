"""Where edges of flat shapes run on the picture: pixels that they cross may resemble all their neighbours."""

import numpy as np

from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.shapes.family import Hulls

STEP = 0.5
"""Distance of the places along an edge, pixels: an edge may cross no more than a corner of a pixel unseen."""


def edge_places(camera: Pinhole, hulls: Hulls) -> Integers:
    """Pixels that edges of shapes pass, (2, N): column and row."""
    away = hulls.corners.transpose(1, 0, 2) - camera.position[:, :, None]
    depth = dot(away, camera.forward[:, :, None])
    right = dot(away, camera.right[:, :, None]) / camera.half_width
    up = dot(away, camera.up[:, :, None]) / camera.half_height
    space = np.stack((right, up, depth))
    found = [np.zeros((2, 0), dtype=np.int64)]
    for first, second in hulls.edges:
        starts, ends = _inside(space[:, first], space[:, second])
        found += [_pixels(camera, starts[:, k], ends[:, k]) for k in np.flatnonzero(starts[2] > 0).tolist()]
    return np.hstack(found)


def within(starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """Where segments (...) enter and leave the region of positive linear functions (C, ...).

    The functions are given at the segments' ends. Parameters from 0 to 1; the second is not above the first
    where nothing is inside.
    """
    enters, leaves = np.zeros(starts.shape[1:]), np.ones(starts.shape[1:])
    for one, other in zip(starts, ends, strict=True):
        crossing = np.divide(one, one - other, out=np.zeros_like(one), where=one != other)
        enters = np.where(one < 0, np.maximum(enters, crossing), enters)
        leaves = np.where(other < 0, np.minimum(leaves, crossing), leaves)
        leaves = np.where((one < 0) & (other < 0), -1.0, leaves)
    return enters, leaves


def within_view(starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """The same of segments (3, ...) within the view |x| <= depth, |y| <= depth."""
    sides = [(axis, side) for axis in (0, 1) for side in (-1.0, 1.0)]
    one, other = (
        np.stack([place[2] + side * place[axis] for axis, side in sides]) for place in (starts, ends)
    )
    return within(one, other)


def _inside(starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """The parts of edges (3, K) within the view; depth 0 where there is none."""
    enters, leaves = within_view(starts, ends)
    seen: Masks = enters < leaves
    along = ends - starts
    return (starts + enters * along) * seen, (starts + leaves * along) * seen


def _pixels(camera: Pinhole, start: Floats, end: Floats) -> Integers:
    ends = np.stack((start, end), axis=1)
    x, y = ends[:2] / np.maximum(ends[2], np.finfo(np.float64).tiny)
    x, y = (x + 1) / 2 * camera.width, (1 - y) / 2 * camera.height
    steps = np.linspace(0, 1, int(np.hypot(*np.diff([x, y])[:, 0]) / STEP) + 2)
    size = np.array([[camera.width], [camera.height]])
    found = np.floor(np.stack((x[0] + steps * (x[1] - x[0]), y[0] + steps * (y[1] - y[0])))).astype(np.int64)
    return np.clip(found, 0, size - 1)
