"""Ellipsoids: the unit sphere under a centre and three perpendicular semi-axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.interaction import Points, Rays
from renderer.math.arrays import (
    Floats,
    Integers,
    Masks,
    columns,
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
from renderer.self_intersection import OriginSurfaces, previous_sides, settled
from renderer.shapes.family import HULL_MARGIN, SINGLE_PRIMITIVE, Family, box

SURELY_OUTSIDE = 4.0
"""Starts at a larger squared distance from the unit sphere's centre are outside despite rounding."""


@dataclass(slots=True, eq=False)
class Ellipsoids(Family):
    """A family of ellipsoids.

    Attributes
    ----------
    centers : (3, K) float64
    axes : (3, 3, K) float64
        Semi-axis, coordinate, ellipsoid.
    inverse : (3, 3, K) float64
        Rows of the inverse: semi-axis over its squared length. A point minus the centre, first subtracted,
        goes through it into the frame where the ellipsoid is the unit sphere.
    """

    centers: Floats
    axes: Floats
    inverse: Floats

    def corners(self) -> Floats:
        """Corners of the box along the axes, (8, 3, K)."""
        return box(self.centers, self.axes)

    def reach(self, direction: Floats) -> Floats:
        """By the support function c . d + |(a . d, b . d, c . d)|: the box is up to 1.7 times as wide."""
        along = np.stack([dot(axis, direction) for axis in self.axes])
        return dot(self.centers, direction) + lengths(along)

    @property
    def surface(self) -> str:
        """An ellipsoid."""
        return "ellipsoid"

    def signatures(self, origin: Floats, direction: Floats, reach: float) -> tuple[Floats, Floats]:
        """A room by the centre, which has three roundings along each axis."""
        del reach
        return dot(self.centers - origin, direction), 8 * PLANE_ERROR * (self.sizes + magnitude(origin))

    def coincide(self, own: Integers, other: Family, others: Integers) -> Masks:
        """Whether two are one ellipsoid: in the frame of the first, the axes of the second turn its sphere.

        That is, their matrix B has an orthogonal inverse, B^T B = 1, and the centres are in one place.
        """
        assert isinstance(other, Ellipsoids), "only ellipsoids are compared with ellipsoids"
        inverse = taken(self.inverse, own)
        centers, axes = taken(other.centers, others), taken(other.axes, others)
        offset = centers - taken(self.centers, own)
        reach = np.abs(centers) + np.abs(taken(self.centers, own))
        turned = np.stack([[dot(axis, row) for row in inverse] for axis in axes])
        bound = PLANE_ERROR * np.stack([[dot(np.abs(axis), np.abs(row)) for row in inverse] for axis in axes])
        together = np.ones(own.size, dtype=bool)
        for i, row in enumerate(inverse):
            together &= np.abs(dot(offset, row)) <= PLANE_ERROR * dot(reach, np.abs(row))
            for j in range(i, 3):
                error = dot(turned[i], turned[j]) - (i == j)
                size, other_size = np.abs(turned[i]), np.abs(turned[j])
                together &= np.abs(error) <= dot(size, bound[j]) + dot(bound[i], other_size)
        return together

    def to_sphere(self, vectors: Floats, shape: int) -> Floats:
        """Vectors (3, N) in the frame of one ellipsoid's unit sphere."""
        rows = self.inverse[:, :, shape, None]
        return np.stack([dot(vectors, row) for row in rows])

    def holds(self, place: Floats) -> bool:
        """Whether a place (3, 1) is inside of an ellipsoid or, within `HULL_MARGIN`, on it."""
        return any(
            lengths(self.to_sphere(place - self.centers[:, shape, None], shape)).item() < 1 + HULL_MARGIN
            for shape in range(self.numbers.size)
        )

    def shades_itself(self, viewer: Floats | None) -> bool:
        """Seen from inside, an ellipsoid hides what is outside."""
        return viewer is None or self.holds(viewer)

    def smooth_shapes(self) -> Integers:
        """No shape: all normals are those of the surface."""
        return self.numbers[:0]

    def intersect(self, shape: int, rays: Rays) -> None:
        """Hits from the closest approach to the centre (Haines et al., Ray Tracing Gems, ch. 7).

        The part of the origin across the ray is projected twice: once leaves the rounding of a long
        projection in it, which in front of a thin ellipsoid is longer than the sphere's radius. Then
        1 - h^2 = (1 - h)(1 + h) loses nothing, and of the roots the larger comes from a sum of one sign and
        the smaller from their product.
        """
        origin = self.to_sphere(rays.origins - self.centers[:, shape, None], shape)
        direction = self.to_sphere(rays.directions, shape)
        length = np.sqrt(dot(direction, direction))
        with np.errstate(divide="ignore", invalid="ignore"):
            direction /= length
        along = dot(origin, direction)
        across = origin - along * direction
        across = across - dot(across, direction) * direction
        closest = np.sqrt(dot(across, across))
        found = np.flatnonzero(closest <= 1)
        if found.size:
            origin = taken(np.broadcast_to(origin, direction.shape), found)
            lines = _Lines(
                origin,
                taken(direction, found),
                length[found],
                along[found],
                taken(across, found),
                closest[found],
            )
            self._offer_roots(shape, rays, found, lines)

    def _offer_roots(self, shape: int, rays: Rays, found: Integers, lines: "_Lines") -> None:
        """Hits of the lines that pass through the sphere: a start outside enters, any other leaves."""
        half_chord = np.sqrt((1 - lines.closest) * (1 + lines.closest))
        distance = np.sqrt(dot(lines.origin, lines.origin))
        power = (distance - 1) * (distance + 1)
        on_surface = np.abs(power) <= gamma(16) * (1 + distance * distance)
        power = np.where(on_surface, 0.0, power)
        inward = np.ones(found.size, dtype=bool)
        if rays.origin_surfaces is not None:
            power, inward = self._departed(shape, rays.origin_surfaces, found, power)
        entering = power > 0
        far = -(lines.along + np.copysign(half_chord, lines.along))
        with np.errstate(divide="ignore", invalid="ignore"):
            near = np.where(far == 0, 0.0, power / far)
        t = np.where(entering, near, np.maximum(near, far))
        ahead = np.flatnonzero((t > 0) & inward)
        passed = np.where(entering, -half_chord, half_chord)[ahead]
        x, y, z = taken(lines.across, ahead) + passed * taken(lines.direction, ahead)
        t = t[ahead] / lines.length[ahead]
        rays.offer(found[ahead], t, (x, y, z), self.numbers[shape : shape + 1], SINGLE_PRIMITIVE)

    def _departed(
        self, shape: int, start: OriginSurfaces, found: Integers, power: Floats
    ) -> tuple[Floats, Masks]:
        """Powers with certain signs, 0 for rays that leave this ellipsoid, and a mask of possible hits.

        A ray that leaves it hits it again only from inside, at the far root.
        """
        own = start.shapes[found] == self.numbers[shape]
        previous = start.previous_origins_at(found) - self.centers[:, shape, None]
        distance = lengths(self.to_sphere(previous, shape))
        shortest = 1 / lengths(self.inverse[:, :, shape].T).max()
        bound = gamma(48) * (start.sizes[found] + self.sizes[shape]) / shortest
        sides = previous_sides((distance - 1) * (distance + 1), bound)
        return settled(power, bound, sides, own), ~(own & start.outside[found])

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Positions put back on the sphere, normals by the inverse transposed, never by the axes."""
        where = self._on_sphere(points, chosen, shapes)
        axes, inverse = taken(self.axes, shapes), taken(self.inverse, shapes)
        centers = taken(self.centers, shapes)
        put(points.positions, chosen, centers + where[0] * axes[0] + where[1] * axes[1] + where[2] * axes[2])
        normals = unit(where[0] * inverse[0] + where[1] * inverse[1] + where[2] * inverse[2])
        points.face_rays(chosen, normals, dot(taken(points.directions, chosen), normals) > 0)

    def _on_sphere(self, points: Points, chosen: Integers, shapes: Integers) -> Floats:
        """Points where rays enter or leave the unit sphere, (3, M).

        The rounding of a long t is taken back along the ray, never across it: in front of a thin ellipsoid it
        is many times the sphere's radius. A start that far outside can only enter.
        """
        origins = points.origins if points.origins.shape[1] == 1 else taken(points.origins, chosen)
        relative = origins - taken(self.centers, shapes)
        inverse = taken(self.inverse, shapes)
        origin = np.stack([dot(relative, row) for row in inverse])
        directions = taken(points.directions, chosen)
        along = np.stack([dot(directions, row) for row in inverse])
        where = origin + points.t[chosen] * along
        along = unit(along)
        passed = dot(where, along)
        across = where - passed * along
        half_chord = np.sqrt(np.maximum(0.0, 1 - dot(across, across)))
        passed = np.where(dot(origin, origin) > SURELY_OUTSIDE, -1.0, passed)
        return unit(across + np.copysign(half_chord, passed) * along)

    def coordinates(self, points: Points, chosen: Integers, shapes: Integers) -> Floats:
        """Longitude about the third axis from the first, latitude from its lower end, both in [0, 1].

        By atan2: an arc cosine loses half the digits at the poles. Longitude 1 is longitude 0.
        """
        del shapes
        x, y, z = taken(points.hits, chosen)
        longitude = np.arctan2(y, x) / (2 * np.pi)
        longitude = np.where(longitude < 0, longitude + 1, longitude)
        longitude = np.where((longitude >= 1) | ((x == 0) & (y == 0)), 0.0, longitude)
        return np.stack((longitude, np.arctan2(np.hypot(x, y), -z) / np.pi))

    def frames(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Along the parallels; the axes may be left-handed."""
        angle = 2 * np.pi * points.coordinates[0, chosen]
        first, second, _ = self.axes[:, :, shapes]
        return unit(np.cos(angle) * second - np.sin(angle) * first), self.handedness()[shapes]

    def handedness(self) -> Floats:
        """1 where the axes are right-handed, -1 where they are left-handed, (K,)."""
        first, second, third = self.axes
        return np.copysign(1.0, dot(cross(unit(first), unit(second)), third))

    def derivatives(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Along the parallels and the meridians, by the turn: u = longitude / 2 pi, v = latitude / pi."""
        longitude, latitude = points.coordinates[:, chosen] * np.array([[2 * np.pi], [np.pi]])
        first, second, third = self.axes[:, :, shapes]
        cosine, sine = np.cos(longitude), np.sin(longitude)
        outward = cosine * first + sine * second
        by_u = 2 * np.pi * np.sin(latitude) * (cosine * second - sine * first)
        return by_u, np.pi * (np.cos(latitude) * outward + np.sin(latitude) * third)


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """N lines in the frame of a unit sphere: unit directions, and their lengths before.

    `along` is the origin's part along the line; `across`, the other part, is the line's place closest to the
    centre, at the distance `closest`.
    """

    origin: Floats
    direction: Floats
    length: Floats
    along: Floats
    across: Floats
    closest: Floats


def build(
    numbers: Sequence[int], shapes: Sequence[language.Ellipsoid | language.Sphere], assets: AssetSource
) -> Ellipsoids:
    """The family of some ellipsoids and spheres of a scene, given with their numbers."""
    del assets
    centers = columns([shape.center for shape in shapes])
    axes = stacked([_axes(shape) for shape in shapes])
    squared = np.stack([dot(axis, axis) for axis in axes])
    return Ellipsoids(
        kind="ellipsoid",
        numbers=np.array(numbers, dtype=np.int64),
        sizes=magnitude(centers) + magnitude(axes[0]) + magnitude(axes[1]) + magnitude(axes[2]),
        centers=centers,
        axes=axes,
        inverse=axes / squared[:, None],
    )


def _axes(shape: language.Ellipsoid | language.Sphere) -> Sequence[Sequence[float]]:
    if isinstance(shape, language.Sphere):
        return ((shape.radius, 0.0, 0.0), (0.0, shape.radius, 0.0), (0.0, 0.0, shape.radius))
    return shape.axes
