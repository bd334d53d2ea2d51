"""Rectangles and parallelograms: corner + u e1 + v e2 with u and v in [0, 1]."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.interaction import Points, Rays
from renderer.math.arrays import (
    Floats,
    Integers,
    cross,
    dot,
    lengths,
    magnitude,
    put,
    stacked,
    taken,
    unit,
)
from renderer.math.numerics import PLANE_ERROR, gamma
from renderer.self_intersection import previous_sides, settled
from renderer.shapes.family import SINGLE_PRIMITIVE
from renderer.shapes.polygons import FlatFamily, Polygons


def edges_of(
    center: Floats, normal: Floats, tangent: Floats, size: Sequence[float] | Floats
) -> tuple[Floats, Floats, Floats]:
    """Corners and edges, each (3, K), of the form with centre, normal, tangent and size (2, K).

    The tangent is made perpendicular to the normal twice; once leaves an error of eps / sin(angle).
    """
    normal = unit(normal)
    tangent = unit(unit(tangent) - normal * dot(unit(tangent), normal))
    tangent = unit(tangent - normal * dot(tangent, normal))
    first, second = tangent * size[0], cross(normal, tangent) * size[1]
    return center - first / 2 - second / 2, first, second


def _edges(shapes: Sequence[language.Rectangle | language.Parallelogram]) -> Floats:
    """Corners, first and second edges of either form of rectangles, (3, 3, K)."""
    cornered = [shape for shape in shapes if isinstance(shape, language.Parallelogram)]
    centered = [shape for shape in shapes if isinstance(shape, language.Rectangle)]
    center, normal, tangent = stacked([(shape.center, shape.normal, shape.tangent) for shape in centered])
    sizes = np.array([shape.size for shape in centered], dtype=np.float64).reshape(-1, 2).T
    edges = np.empty((3, 3, len(shapes)))
    which = np.array([isinstance(shape, language.Rectangle) for shape in shapes])
    edges[:, :, ~which] = stacked([(shape.corner, *shape.edges) for shape in cornered])
    edges[:, :, which] = edges_of(center, normal, tangent, sizes)
    return edges


@dataclass(slots=True, eq=False)
class Rectangles(FlatFamily):
    """A family of rectangles; arrays are (3, K) float64.

    Attributes
    ----------
    anchors, first, second : (3, K)
        Corner and edge vectors.
    products : (3, K)
        first x second, not normalised.
    """

    anchors: Floats
    first: Floats
    second: Floats
    products: Floats

    def corners(self) -> Floats:
        """The four corners, (4, 3, K)."""
        far = self.anchors + self.first
        return np.stack((self.anchors, far, self.anchors + self.second, far + self.second))

    def edges(self) -> tuple[tuple[int, int], ...]:
        """The four sides."""
        return (0, 1), (0, 2), (1, 3), (2, 3)

    def intersect(self, shape: int, rays: Rays) -> None:
        """Hits by triple products.

        Projection on the edges would be wrong where they are not perpendicular, even by a rounding.
        The border is wider by what rounding can move it, so that rectangles that share an edge leave no
        gap, in whichever form they are given. A start whose distance from the plane is within rounding is
        on it, and that is no hit, unless the ray before came from the other side (`self_intersection`).
        """
        anchor, first, second, product = (
            array[:, shape : shape + 1] for array in (self.anchors, self.first, self.second, self.products)
        )
        from_anchor = rays.origins - anchor
        moment = cross(from_anchor, rays.directions)
        slope = dot(rays.directions, product)
        side = np.copysign(1.0, slope)
        span = np.abs(slope)
        u, v = -side * dot(moment, second), side * dot(moment, first)
        depth = -side * dot(from_anchor, product)
        # A difference, a product of two edges and a sum of three: at most eight roundings lead to the depth.
        rounding = gamma(8) * dot(np.abs(from_anchor), _absolute_cross(first, second))
        if rays.origin_surfaces is not None:
            start = rays.origin_surfaces
            bound = rounding + PLANE_ERROR * (start.sizes + self.sizes[shape]) * magnitude(product)
            previous = -side * dot(start.previous_origins - anchor, product)
            own = start.shapes == self.numbers[shape]
            depth = settled(depth, bound, previous_sides(previous, bound), own)
            # Signs within rounding are settled by the path.
            rounding = np.zeros(1)
        border = magnitude(rays.directions) * (gamma(4) * lengths(from_anchor) + gamma(1) * self.sizes[shape])
        beside, above = border * lengths(second), border * lengths(first)
        hit = (
            (u >= -beside) & (u <= span + beside) & (v >= -above) & (v <= span + above) & (depth > rounding)
        ) & (span > 0)
        found = np.flatnonzero(hit)
        if found.size:
            span = span[found]
            depths = np.broadcast_to(depth, hit.shape)[found]
            u, v = (np.clip(part[found] / span, 0.0, 1.0) for part in (u, v))
            rays.offer(found, depths / span, (u, v), self.numbers[shape : shape + 1], SINGLE_PRIMITIVE)

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Positions from the surface coordinates: they stay on the plane however long the ray was."""
        u, v = taken(points.hits[:2], chosen)
        positions = (
            taken(self.anchors, shapes) + u * taken(self.first, shapes) + v * taken(self.second, shapes)
        )
        put(points.positions, chosen, positions)
        flipped = dot(taken(points.directions, chosen), taken(self.products, shapes)) > 0
        points.face_rays(chosen, taken(self.normals, shapes), flipped)

    def frames(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Tangents along the first edges; the normals are those of both edges, so nothing is mirrored."""
        del points, chosen
        return unit(self.first[:, shapes]), np.ones(shapes.size)

    def derivatives(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Derivatives of the positions by u and v: the edges."""
        del points, chosen
        return self.first[:, shapes], self.second[:, shapes]

    def smooth_shapes(self) -> Integers:
        """No shapes, as all normals are those of planes."""
        return self.numbers[:0]

    def occluders(self) -> Polygons:
        """The same rectangles as occluders."""
        across, along = unit(cross(self.second, self.normals)), unit(cross(self.normals, self.first))
        opposite = self.anchors + self.first + self.second
        return Polygons(
            numbers=self.numbers,
            primitives=np.zeros_like(self.numbers),
            sizes=self.sizes,
            normals=self.normals,
            anchors=self.anchors,
            edge_normals=np.stack((across, along, -across, -along)),
            edge_anchors=np.stack((self.anchors, self.anchors, opposite, opposite)),
            corners=self.corners(),
        )


def _absolute_cross(a: Floats, b: Floats) -> Floats:
    a, b = np.abs(a), np.abs(b)
    return np.stack((a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2], a[0] * b[1] + a[1] * b[0]))


def build(
    numbers: Sequence[int], shapes: Sequence[language.Rectangle | language.Parallelogram], assets: AssetSource
) -> Rectangles:
    """The family of some rectangles of a scene, given with their numbers."""
    del assets
    return from_edges(np.array(numbers, dtype=np.int64), *_edges(shapes))


def from_edges(numbers: Integers, anchors: Floats, first: Floats, second: Floats) -> Rectangles:
    """The family with the given corners and edges, each (3, K)."""
    products = cross(first, second)
    return Rectangles(
        kind="rectangle",
        numbers=numbers,
        sizes=magnitude(anchors) + magnitude(first) + magnitude(second),
        anchors=anchors,
        first=first,
        second=second,
        products=products,
        normals=unit(cross(unit(first), unit(second))),
    )
