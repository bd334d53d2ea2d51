"""Shapes too thin on the picture for pilot samples on a lattice to hit them."""

import numpy as np

from renderer.adaptive.lattice import stride_for
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.shapes.family import Hulls

DIRECTIONS = 16
"""In which the width of a shape on the picture is measured, over half a turn: the least is 2 % too large."""

TAPERED = 0.5
"""A drawn-out ellipse of a length and a width is narrower than a pixel over length / (4 width**2) pixels at
either end: one pixel, where the width is this many times the root of the length. Flat shapes need no such
rule, as their edges are marked anyway."""

NARROW = 3
"""Width in pixels below which a round shape has no pixel inside that is shaded like those at its border. A
post of one pixel, lit from the side, was taken to be as bright all over as at its middle: 5 pixels of 4,800
made the true error 0.66/255 where 0.38/255 was reported."""

FARTHEST = 65536
"""Places along a shape at most, however far it reaches beyond the picture."""


def thin_places(camera: Pinhole, hulls: Hulls) -> Integers:
    """Pixels along shapes narrower than the lattice, (2, N): column and row, those outside left out.

    Parameters
    ----------
    camera : Pinhole
    hulls : Hulls
        Shapes that reach behind the camera are left out: they are near, and wide.
    """
    x, y, _, ahead = on_picture(camera, hulls.corners)
    measured = spans(x, y)
    stride = stride_for(camera.width, camera.height)
    width, length = measured.min(axis=0), measured.max(axis=0)
    tapered = TAPERED if hulls.round else 0.0
    narrow = np.flatnonzero(ahead & (width < np.maximum(stride, np.sqrt(stride * length) * tapered)))
    return _pixels(camera, [along(x[:, shape], y[:, shape]) for shape in narrow.tolist()])


def narrow_places(camera: Pinhole, hulls: Hulls) -> Integers:
    """Pixels along parts of curved shapes less than `NARROW` pixels wide, (2, N), as `thin_places`.

    Tips of ellipses shorter than a pixel are left out.
    """
    if hulls.edges:
        return np.zeros((2, 0), dtype=np.int64)
    x, y, _, ahead = on_picture(camera, hulls.corners)
    measured = spans(x, y)
    widths, lengths = measured.min(axis=0), measured.max(axis=0)
    tips = (
        lengths * (1 - np.sqrt(1 - np.minimum(NARROW / np.maximum(widths, NARROW), 1.0) ** 2)) * hulls.round
    )
    found = []
    for shape in np.flatnonzero(ahead & ((tips > 1) | (widths < NARROW))).tolist():
        places = along(x[:, shape], y[:, shape])
        found.append(places[:, profile(hulls, places.shape[1]) * widths[shape] < NARROW])
    return _pixels(camera, found)


def profile(hulls: Hulls, count: int) -> Floats:
    """Width of curved shapes at places (count,) from end to end, in shares of the greatest.

    An ellipse has 2 sqrt(s (1 - s)) of it at a share s of its length; of other shapes nothing is known.
    """
    share = np.linspace(0, 1, count)
    return 2 * np.sqrt(share * (1 - share)) if hulls.round else np.ones(count)


def _pixels(camera: Pinhole, found: list[Floats]) -> Integers:
    """Pixels (2, N) of places (2, n) each, those outside of the picture left out."""
    places = np.floor(np.hstack([np.zeros((2, 0)), *found])).astype(np.int64)
    inside = (places >= 0).all(axis=0) & (places[0] < camera.width) & (places[1] < camera.height)
    return places[:, inside]


def on_picture(camera: Pinhole, corners: Floats) -> tuple[Floats, Floats, Floats, Masks]:
    """Columns, rows and depths of corners, (V, K) each, and which shapes are wholly before the camera, (K,).

    Depths of corners that are not are 1.
    """
    away = corners.transpose(1, 0, 2) - camera.position[:, :, None]
    depth, right, up = (dot(away, axis[:, :, None]) for axis in (camera.forward, camera.right, camera.up))
    ahead: Masks = np.asarray((depth > 0).all(axis=0))
    depth = np.where(depth > 0, depth, 1.0)
    x = (right / depth / camera.half_width + 1) / 2 * camera.width
    y = (1 - up / depth / camera.half_height) / 2 * camera.height
    return x, y, depth, ahead


def spans(x: Floats, y: Floats) -> Floats:
    """Width of each hull on the picture in some directions, (DIRECTIONS, K), pixels."""
    turns = np.arange(DIRECTIONS) * (np.pi / DIRECTIONS)
    along = np.cos(turns)[:, None, None] * x + np.sin(turns)[:, None, None] * y
    return np.ptp(along, axis=1)


def along(x: Floats, y: Floats, *more: Floats) -> Floats:
    """Places (2, n), at most a pixel apart, along the middle of a hull's corners (V,), from end to end.

    What is known of the corners besides is interpolated, and gives further rows.
    """
    away = np.hypot(x[:, None] - x, y[:, None] - y)
    first, second = np.unravel_index(np.argmax(away), away.shape)
    order = np.argsort((x - x[first]) * (x[second] - x[first]) + (y - y[first]) * (y[second] - y[first]))
    half = x.size // 2
    ends = [(values[order[:half]].mean(), values[order[-half:]].mean()) for values in (x, y, *more)]
    steps = np.linspace(0, 1, min(int(away.max()) + 2, FARTHEST))
    return np.stack([start + steps * (end - start) for start, end in ends])
