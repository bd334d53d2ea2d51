"""The watertight ray-triangle test of Woop, Benthin and Wald (2013), for pairs of ray and triangle."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, cross, dot, magnitude, taken
from renderer.math.numerics import PLANE_ERROR, gamma
from renderer.self_intersection import OriginSurfaces, previous_sides, settled


@dataclass(frozen=True, slots=True, eq=False)
class PairHits:
    """Pairs that hit.

    Attributes
    ----------
    pairs : (M,) int64
        Indices of the pairs.
    t : (M,) float64
    u, v : (M,) float64
        Weights of the second and third vertex.
    """

    pairs: Integers
    t: Floats
    u: Floats
    v: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Origins of the rays of P pairs that leave a surface.

    Attributes
    ----------
    own : (P,) bool
        Whether the ray leaves this very triangle, which it then never hits.
    previous_origins : (3, P) or (3, 1) float64
    sizes : (P,) float64
        Magnitudes that formed origin and triangle, scene units.
    """

    own: Masks
    previous_origins: Floats
    sizes: Floats


def start_of(
    origins: OriginSurfaces, rays: Integers, shapes: Integers, primitives: Integers, sizes: Floats
) -> Start:
    """The start of pairs of rays (P,) with triangles, numbers and sizes (P,) or (1,)."""
    return Start(
        own=origins.are(rays, shapes, primitives),
        previous_origins=origins.previous_origins_at(rays),
        sizes=origins.sizes[rays] + sizes,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Sheared:
    """Edge functions of P pairs in a frame sheared so that the ray is its axis.

    Each vertex is sheared once and alike for all triangles that share it, and x1 * y2 - y1 * x2 only
    changes its sign when the vertices trade places: no ray slips between neighbours.
    """

    x: list[Floats]
    y: list[Floats]
    depths: list[Floats]
    weights: list[Floats]
    along: Floats

    def found(self) -> Integers:
        """Pairs whose line passes through the triangle, border included."""
        least = np.minimum(np.minimum(self.weights[0], self.weights[1]), self.weights[2])
        greatest = np.maximum(np.maximum(self.weights[0], self.weights[1]), self.weights[2])
        return np.flatnonzero((least >= 0) | (greatest <= 0))

    def within(self, rounding: Floats) -> Integers:
        """Pairs whose line passes through the triangle, or beside it by less than `rounding` (P,)."""
        front = np.ones(rounding.shape, dtype=bool)
        back = front.copy()
        for weight, start, end in zip(self.weights, (1, 2, 0), (2, 0, 1), strict=True):
            edge = np.abs(self.x[end] - self.x[start]) + np.abs(self.y[end] - self.y[start])
            front &= weight >= -rounding * edge
            back &= weight <= rounding * edge
        return np.flatnonzero(front | back)


def _sheared(axis: int, vertices: Floats, origins: Floats, directions: Floats, chosen: Integers) -> _Sheared:
    x_axis, y_axis = (axis + 1) % 3, (axis + 2) % 3
    direction, origin = _at(directions, chosen), _at(origins, chosen)
    shear_x, shear_y = direction[x_axis] / direction[axis], direction[y_axis] / direction[axis]
    x, y, depths = [], [], []
    for vertex in vertices:
        place = _at(vertex, chosen)
        depth = place[axis] - origin[axis]
        x.append((place[x_axis] - origin[x_axis]) - shear_x * depth)
        y.append((place[y_axis] - origin[y_axis]) - shear_y * depth)
        depths.append(depth)
    weights = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
    return _Sheared(x, y, depths, weights, direction[axis])


def _by_axis(directions: Floats) -> Iterator[tuple[int, Integers]]:
    """Pairs sorted by the axis that the rays follow most."""
    x, y, z = np.abs(directions)
    first = (x >= y) & (x >= z)
    second = ~first & (y >= z)
    for axis, leading in enumerate((first, second, ~(first | second))):
        chosen = np.flatnonzero(leading)
        if chosen.size:
            yield axis, chosen


def inside(vertices: Floats, origins: Floats, directions: Floats, rounding: Floats) -> Integers:
    """Pairs whose line passes through the triangle, border included, or within `rounding` (P,) of it.

    Other arguments as for `hits`. The sheared frame makes an error of an origin at most twice as long.
    """
    parts = [
        chosen[_sheared(axis, vertices, origins, directions, chosen).within(2 * rounding[chosen])]
        for axis, chosen in _by_axis(directions)
    ]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


def hits(vertices: Floats, origins: Floats, directions: Floats, start: Start | None = None) -> PairHits:
    """Hits of P pairs.

    Parameters
    ----------
    vertices : (3, 3, P) or (3, 3, 1) float64
        Vertex, coordinate, pair.
    origins : (3, P) or (3, 1) float64
    directions : (3, P) float64
        Finite, not zero.
    start : Start, optional
        For rays that leave a surface.

    Notes
    -----
    Every operation is one rounding of IEEE arithmetic; a fused multiply-add would break the symmetry
    that keeps neighbours tight.
    """
    parts = [
        _hits_along(axis, vertices, origins, directions, chosen, start)
        for axis, chosen in _by_axis(directions)
    ]
    if len(parts) == 1:
        return parts[0]
    nothing = PairHits(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(0))
    parts = parts or [nothing]
    return PairHits(
        np.concatenate([part.pairs for part in parts]),
        np.concatenate([part.t for part in parts]),
        np.concatenate([part.u for part in parts]),
        np.concatenate([part.v for part in parts]),
    )


def _hits_along(
    axis: int,
    vertices: Floats,
    origins: Floats,
    directions: Floats,
    chosen: Integers,
    start: Start | None,
) -> PairHits:
    pairs = _sheared(axis, vertices, origins, directions, chosen)
    if start is None:
        found = pairs.found()
        a, b, c = (weight[found] for weight in pairs.weights)
    else:
        found = pairs.within(2 * PLANE_ERROR * start.sizes[chosen])
        a, b, c = _of_one_sign([weight[found] for weight in pairs.weights])
    sheared = [np.stack((x[found], y[found])) for x, y in zip(pairs.x, pairs.y, strict=True)]
    depths = [np.broadcast_to(depth, chosen.shape)[found] for depth in pairs.depths]
    total = a + b + c
    height = a * depths[0] + b * depths[1] + c * depths[2]
    rounding = _rounding(sheared, depths)
    # In the plane of a triangle that it passes a line has no weights: 0 / 0 is no hit.
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = height / total / pairs.along[found]
        if start is None:
            ahead = (distance > 0) & (np.abs(height) > rounding)
        else:
            bound = rounding / np.abs(total * pairs.along[found])
            distance = _settled(distance, bound, vertices, directions, chosen[found], start)
            ahead = distance > 0
    total = total[ahead]
    return PairHits(chosen[found[ahead]], distance[ahead], b[ahead] / total, c[ahead] / total)


def _of_one_sign(weights: list[Floats]) -> Floats:
    """Weights (3, P) without those that rounding alone made negative: their means stay in the triangle."""
    stacked = np.stack(weights)
    side = np.sign(weights[0] + weights[1] + weights[2])
    return np.maximum(stacked * side, 0.0) * side


def _settled(
    distances: Floats, bounds: Floats, vertices: Floats, directions: Floats, pairs: Integers, start: Start
) -> Floats:
    """Distances along rays that leave a surface, 0 where they leave this triangle."""
    first, second, third = (_at(vertex, pairs) for vertex in vertices)
    product = cross(second - first, third - first)
    slope = dot(product, _at(directions, pairs))
    safe = np.where(slope == 0, 1.0, slope)
    previous = dot(product, first - _at(start.previous_origins, pairs)) / safe
    bounds = bounds + PLANE_ERROR * start.sizes[pairs] * magnitude(product) / np.abs(safe)
    return settled(distances, bounds, previous_sides(previous, bounds), start.own[pairs] | (slope == 0))


def _at(vectors: Floats, chosen: Integers) -> Floats:
    return vectors if vectors.shape[1] in {1, chosen.size} else taken(vectors, chosen)


def _rounding(sheared: list[Floats], depths: list[Floats]) -> Floats:
    """Bound on the rounding of the weighted sum of depths: closer than this, a start is on the triangle."""
    a, b, c = (np.abs(xy) for xy in sheared)
    terms = (
        (c[0] * b[1] + c[1] * b[0]) * np.abs(depths[0])
        + (a[0] * c[1] + a[1] * c[0]) * np.abs(depths[1])
        + (b[0] * a[1] + b[1] * a[0]) * np.abs(depths[2])
    )
    return gamma(16) * terms
