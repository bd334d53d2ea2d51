"""Nearest hits and the points there: places are o + t d, rounded, and nothing knows how far."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.single import SINGLE, STEP, Singles, buffer, dot, normalised
from renderer.math.arrays import cross, put, taken
from renderer.math.arrays import dot as plain_dot
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import WHOLE
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles

if TYPE_CHECKING:
    from renderer.interaction import Points, Rays
    from renderer.math.arrays import Integers


@dataclass(slots=True, eq=False)
class TextbookTriangles(Triangles):
    """Triangles in float32."""

    def intersect(self, shape: int, rays: Rays) -> None:
        """Hits by Moeller and Trumbore (1997).

        Their triple products are turned so that only the direction differs from ray to ray.
        """
        first_vertex, *others = self.vertices[:, :, shape : shape + 1]
        first, second = (vertex - first_vertex for vertex in others)
        away = rays.origins - first_vertex
        beside = cross(away, first)
        determinant, u, v, spare = _rows(rays, "determinant", "u", "v", "spare")
        np.reciprocal(dot(rays.directions, cross(second, first), determinant, spare), out=determinant)
        np.multiply(dot(rays.directions, cross(second, away), u, spare), determinant, out=u)
        np.multiply(dot(rays.directions, beside, v, spare), determinant, out=v)
        t = np.multiply(plain_dot(second, beside), determinant, out=determinant)
        found = np.flatnonzero((u >= 0) & (v >= 0) & (np.add(u, v, out=spare) <= 1) & (t > STEP))
        one = slice(shape, shape + 1)
        rays.offer(found, t[found], (u[found], v[found]), self.numbers[one], self.primitives[one])

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Places along the rays; normals turned to them."""
        u, v = taken(points.hits, chosen)
        _place(points, chosen, taken(self.normals, shapes))
        corners = taken(self.texture, shapes)
        put(points.coordinates, chosen, (1 - u - v) * corners[0] + u * corners[1] + v * corners[2])


@dataclass(slots=True, eq=False)
class TextbookRectangles(Rectangles):
    """Rectangles in float32."""

    def intersect(self, shape: int, rays: Rays) -> None:
        """Hits with the plane, projected on edges that are taken for perpendicular."""
        anchor, first, second, normal = (
            part[:, shape : shape + 1] for part in (self.anchors, self.first, self.second, self.normals)
        )
        away = rays.origins - anchor
        t, u, v, spare = _rows(rays, "t", "u", "v", "spare")
        dot(rays.directions, normal, t, spare)
        np.divide(-plain_dot(away, normal), t, out=t)
        for place, edge in ((u, first), (v, second)):
            scaled = edge / plain_dot(edge, edge)
            np.multiply(dot(rays.directions, scaled, place, spare), t, out=place)
            np.add(place, plain_dot(away, scaled), out=place)
        found = np.flatnonzero((u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (t > STEP))
        rays.offer(found, t[found], (u[found], v[found]), self.numbers[shape : shape + 1], WHOLE)

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Places along the rays; normals turned to them."""
        _place(points, chosen, taken(self.normals, shapes))
        put(points.coordinates, chosen, taken(points.hits, chosen))


@dataclass(slots=True, eq=False)
class TextbookEllipsoids(Ellipsoids):
    """Ellipsoids in float32."""

    def intersect(self, shape: int, rays: Rays) -> None:
        """Roots of the quadratic a t^2 + 2 b t + c of the ray in the unit sphere's frame."""
        rows = self.inverse[:, :, shape, None]
        relative = rays.origins - self.centers[:, shape, None]
        origin = np.stack([plain_dot(relative, row) for row in rows])
        spare = _rows(rays, "spare")[0]
        names = ("x", "y", "z")
        direction = [
            dot(rays.directions, row, out, spare) for row, out in zip(rows, _rows(rays, *names), strict=True)
        ]
        a, b, discriminant = _rows(rays, "a", "b", "discriminant")
        dot(direction, direction, a, spare)
        dot(origin, direction, b, spare)
        np.multiply(a, plain_dot(origin, origin) - 1, out=spare)
        np.subtract(np.multiply(b, b, out=discriminant), spare, out=discriminant)
        found = np.flatnonzero(discriminant >= 0)
        root, a, b = np.sqrt(discriminant[found]), a[found], b[found]
        near, far = (-b - root) / a, (-b + root) / a
        t = np.where(near > STEP, near, far)
        ahead = np.flatnonzero(t > STEP)
        found, t = found[ahead], t[ahead]
        starts = taken(np.broadcast_to(origin, (3, rays.t.size)), found)
        where = [start + t * part[found] for start, part in zip(starts, direction, strict=True)]
        rays.offer(found, t, _angles(where), self.numbers[shape : shape + 1], WHOLE)

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Places along the rays; normals by the inverse transposed."""
        places = _places(points, chosen)
        inverse = taken(self.inverse, shapes)
        relative = places - taken(self.centers, shapes)
        x, y, z = (plain_dot(relative, row) for row in inverse)
        _place(points, chosen, normalised(x * inverse[0] + y * inverse[1] + z * inverse[2]))
        put(points.coordinates, chosen, taken(points.hits, chosen))


def _rows(rays: Rays, *names: str) -> list[Singles]:
    """A buffer (N,) for each name."""
    return [buffer(name, 1, rays.t.size)[0] for name in names]


def _angles(where: list[Singles]) -> tuple[Singles, Singles]:
    """Longitude by arc tangent and latitude by arc cosine, both in [0, 1]."""
    x, y, z = where
    longitude = np.arctan2(y, x) / SINGLE.type(2 * np.pi)
    latitude = np.arccos(np.clip(-z, -1, 1)) / SINGLE.type(np.pi)
    return np.where(longitude < 0, longitude + 1, longitude), latitude


def _places(points: Points, chosen: Integers) -> Singles:
    origins = points.origins if points.origins.shape[1] == 1 else taken(points.origins, chosen)
    return origins + points.t[chosen] * taken(points.directions, chosen)


def _place(points: Points, chosen: Integers, normals: Singles) -> None:
    put(points.positions, chosen, _places(points, chosen))
    flipped = plain_dot(taken(points.directions, chosen), normals) > 0
    points.flipped[chosen] = flipped
    facing = np.where(flipped, -normals, normals)
    put(points.normals, chosen, facing)
