"""Nearest hits of rays with triangles: asking every one, or only those whose box a textbook test meets."""

from collections.abc import Callable

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, Pairs
from renderer.shapes import woop

Box = tuple[Pairs, Pairs]
"""Least and greatest corner, (3,) each."""

BoxTest = Callable[[Box, Pairs, Pairs], Masks]
"""A box, origins (N, 3) and directions (N, 3) of one dtype, to whether the rays meet the box (N,)."""


def nearest(
    corners: Floats, origins: Floats, directions: Floats, order: Integers | None = None
) -> tuple[Floats, Integers]:
    """Distance and number of the nearest triangle of (T, 3, 3), of equal ones the first that was asked.

    Parameters
    ----------
    corners : (T, 3, 3) float64
        Triangle, vertex, coordinate.
    origins, directions : (N, 3) float64
    order : (T,) int64, optional
        In which the triangles are asked; by number unless given.

    Returns
    -------
    t : (N,) float64
        inf for a miss.
    first : (N,) int64
        -1 for a miss.
    """
    t, first = np.full(len(origins), np.inf), np.full(len(origins), -1)
    for number in np.arange(len(corners)) if order is None else order:
        rays, found = _hits(corners[number], origins, directions)
        nearer = found < t[rays]
        t[rays[nearer]], first[rays[nearer]] = found[nearer], number
    return t, first


def nearest_in_met_boxes(
    corners: Floats, origins: Floats, directions: Floats, meets: BoxTest, dtype: type[np.floating]
) -> Floats:
    """Distance (N,) of the nearest triangle, where only those are asked whose box a test in `dtype` meets."""
    start, along = origins.astype(dtype), directions.astype(dtype)
    t = np.full(len(origins), np.inf)
    for triangle in corners:
        box = triangle.min(axis=0).astype(dtype), triangle.max(axis=0).astype(dtype)
        rays, found = _hits(triangle, origins, directions)
        with np.errstate(all="ignore"):
            met = meets(box, start[rays], along[rays])
        np.minimum.at(t, rays[met], found[met])
    return t


def nearest_by_entries(
    corners: Floats, origins: Floats, directions: Floats, dtype: type[np.floating]
) -> Floats:
    """Distance (N,) of the nearest triangle, where none is asked whose box begins behind a known hit.

    From the last triangle to the first; boxes begin where arithmetic in `dtype` says.
    """
    start, inverse = origins.astype(dtype), 1 / directions.astype(dtype)
    t = np.full(len(origins), np.inf)
    for triangle in corners[::-1]:
        low, high = triangle.min(axis=0).astype(dtype), triangle.max(axis=0).astype(dtype)
        sides = [(side - start) * inverse for side in (low, high)]
        begins = np.minimum(*sides).max(axis=1)
        rays, found = _hits(triangle, origins, directions)
        asked = begins[rays] <= t[rays]
        np.minimum.at(t, rays[asked], found[asked])
    return t


def _hits(triangle: Floats, origins: Floats, directions: Floats) -> tuple[Integers, Floats]:
    found = woop.hits(triangle[:, :, None], origins.T, directions.T)
    return found.pairs, found.t


def plain_slabs(box: Box, origins: Pairs, directions: Pairs) -> Masks:
    """The textbook's test: minimum and maximum hand a NaN on, and nothing allows for rounding."""
    first, second = ((side - origins) / directions for side in box)
    near = np.minimum(first, second).max(axis=1)
    far = np.maximum(first, second).min(axis=1)
    return (near <= far) & (far >= 0)


def exact_sides_slabs(box: Box, origins: Pairs, directions: Pairs) -> Masks:
    """A test that drops NaN, but multiplies by rounded inverses and allows for no rounding."""
    inverse = 1 / directions
    first, second = ((side - origins) * inverse for side in box)
    near = np.fmax.reduce(np.fmin(first, second), axis=1)
    far = np.fmin.reduce(np.fmax(first, second), axis=1)
    return (near <= far) & (far >= 0)
