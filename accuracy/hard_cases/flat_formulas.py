"""Formulas for flat shapes as textbooks have them, to count what they get wrong.

All take arrays (..., 3) of one dtype that broadcast against each other, and give the distance (...) of each
ray in units of its direction: inf or NaN for a miss.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from renderer.math.arrays import Masks, Pairs

Triple = Sequence[Pairs]
"""Three vertices, or a corner and two edges."""
Formula = Callable[[Triple, Pairs, Pairs], Pairs]
"""A shape, origins and directions, to distances."""

SMALL = 1e-6
"""What counts as parallel in the code of Moeller and Trumbore (1997), and in many books after it."""


def moeller_trumbore(vertices: Triple, origins: Pairs, directions: Pairs, limit: float = 0.0) -> Pairs:
    """Moeller and Trumbore (1997); determinants below `limit` are parallel."""
    a, b, c = vertices
    first, second, away = b - a, c - a, origins - a
    across = np.cross(directions, second)
    determinant = _dot(first, across)
    beside = np.cross(away, first)
    u, v = _dot(away, across) / determinant, _dot(directions, beside) / determinant
    t = _dot(second, beside) / determinant
    return _without(t, (np.abs(determinant) < limit) | (u < 0) | (u > 1) | (v < 0) | (u + v > 1))


def plane_and_sides(vertices: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """The place where the ray meets the plane, and whether it lies on the inner side of each edge."""
    a, b, c = vertices
    normal = np.cross(b - a, c - a)
    t = _dot(a - origins, normal) / _dot(directions, normal)
    places = origins + t[..., None] * directions
    missed = np.zeros(t.shape, dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        missed |= _dot(np.cross(end - start, places - start), normal) < 0
    return _without(t, missed)


def woop(vertices: Triple, origins: Pairs, directions: Pairs, *, bounded: bool = False) -> Pairs:
    """Woop, Benthin and Wald (2013); `bounded` drops hits nearer than the error of t, as pbrt-v4 does."""
    order = (np.argmax(np.abs(directions), axis=-1)[..., None] + [1, 2, 0]) % 3
    length = np.sqrt(_dot(directions, directions))
    along = np.take_along_axis(directions / length[..., None], order, axis=-1)
    places = [np.take_along_axis(vertex - origins, order, axis=-1) for vertex in vertices]
    x, y = (
        np.stack([place[..., k] - along[..., k] / along[..., 2] * place[..., 2] for place in places])
        for k in (0, 1)
    )
    depths = np.stack([place[..., 2] / along[..., 2] for place in places])
    weights = np.stack([x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]])
    total = weights.sum(axis=0)
    t = (weights * depths).sum(axis=0) / total
    missed = (weights < 0).any(axis=0) & (weights > 0).any(axis=0)
    if bounded:
        bound = _bound_of_t(*(np.abs(part).max(axis=0) for part in (x, y, depths, weights)))
        missed |= t <= bound / np.abs(total)
    return _without(t / length, missed | (total == 0))


def _bound_of_t(x: Pairs, y: Pairs, depth: Pairs, weight: Pairs) -> Pairs:
    """As in `Triangle::Intersect` of pbrt-v4, times the sum of the weights."""
    unit = np.finfo(x.dtype).eps / 2
    three, five, two = (n * unit / (1 - n * unit) for n in (3, 5, 2))
    of_x, of_y, of_depth = five * (x + depth), five * (y + depth), three * depth
    of_weight = 2 * (two * x * y + of_y * x + of_x * y)
    return 3 * (three * weight * depth + of_weight * depth + of_depth * weight)


def projected_on_edges(edges: Triple, origins: Pairs, directions: Pairs, limit: float = 0.0) -> Pairs:
    """The place where the ray meets the plane, projected on two edges that are taken for perpendicular."""
    corner, first, second = edges
    normal = np.cross(first, second)
    slope = _dot(directions, normal)
    t = _dot(corner - origins, normal) / slope
    away = origins + t[..., None] * directions - corner
    u, v = _dot(away, first) / _dot(first, first), _dot(away, second) / _dot(second, second)
    return _without(t, (np.abs(slope) < limit) | (u < 0) | (u > 1) | (v < 0) | (v > 1))


def closed_parallelogram(edges: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """By triple products, with a border that is as wide as its numbers say and no wider."""
    corner, first, second = edges
    normal, away = np.cross(first, second), origins - corner
    slope, moment = _dot(directions, normal), np.cross(away, directions)
    u, v = -_dot(moment, second) / slope, _dot(moment, first) / slope
    return _without(-_dot(away, normal) / slope, (u < 0) | (u > 1) | (v < 0) | (v > 1))


def normal_form(edges: Triple, origins: Pairs, directions: Pairs) -> Pairs:
    """Where a ray meets the plane n . x = k of unit normal n."""
    corner, first, second = edges
    product = np.cross(first, second)
    normal = product / np.sqrt(_dot(product, product))[..., None]
    t = (_dot(normal, corner) - _dot(normal, origins)) / _dot(normal, directions)
    return _without(t, np.zeros(t.shape, dtype=bool))


def _dot(a: Pairs, b: Pairs) -> Pairs:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _without(t: Pairs, missed: Masks) -> Pairs:
    # A comparison with NaN is false: as in the books, 0/0 is not sorted out.
    return np.where(missed | (t <= 0), np.inf, t)


def vertices_of(triangle: Any, dtype: np.dtype[Any]) -> list[Pairs]:
    """Vertices of a triangle of a scene, each (3,)."""
    return list(np.array(triangle.vertices, dtype=dtype))


def triangle(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """A triangle of a scene by Moeller and Trumbore, without a limit."""
    return moeller_trumbore(vertices_of(shape, origins.dtype), origins, directions)


def triangle_with_limit(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """A triangle of a scene by Moeller and Trumbore, with their limit."""
    return moeller_trumbore(vertices_of(shape, origins.dtype), origins, directions, SMALL)


def rectangle(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """A rectangle of a scene, by corner and edges, by projection on the edges."""
    return projected_on_edges(edges_of(shape, origins.dtype), origins, directions)


def rectangle_with_limit(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """The same, and what seems parallel to the plane misses."""
    return projected_on_edges(edges_of(shape, origins.dtype), origins, directions, SMALL)


def edges_of(parallelogram: Any, dtype: np.dtype[Any]) -> list[Pairs]:
    """Corner and edges of a rectangle of a scene, each (3,)."""
    return list(np.array((parallelogram.corner, *parallelogram.edges), dtype=dtype))
