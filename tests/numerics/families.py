"""Seeded families of rays, each hard in one way: at flat shapes and at ellipsoids."""

import itertools
import random
from collections.abc import Callable, Iterator

import numpy as np

from tests.documents import Json, ellipsoid, rectangle, sphere, triangle

Floats = np.ndarray
Ray = tuple[list[float], list[float]]
"""Origin and direction."""
FamilyCase = tuple[Json, list[Ray]]
"""A shape, and rays to try on it."""
Family = Iterator[FamilyCase]
Drawn = tuple[Json, Callable[[], Ray]]
"""A shape, and what draws a ray at it."""
Draw = Callable[[random.Random], float]
Make = Callable[[random.Random], list[list[float]]]
"""Three vertices, or a corner and two edges."""


def between(low: float, high: float) -> Draw:
    """Ten to a power between these: all sizes alike."""
    return lambda chosen: 10 ** chosen.uniform(low, high)


ONE, NEAR = between(0, 0), between(0.5, 0.5)


def family(name: str, draw: Callable[[random.Random], Drawn]) -> Family:
    """Shapes and rays of one seeded stream."""
    chosen = random.Random(name)
    for _ in range(30):
        shape, ray = draw(chosen)
        yield shape, [ray() for _ in range(12)]


def vector(chosen: random.Random, reach: float = 1.0) -> list[float]:
    return [chosen.uniform(-reach, reach) for _ in range(3)]


def direction(chosen: random.Random) -> list[float]:
    """A random unit vector."""
    v = np.array([chosen.gauss(0, 1) for _ in range(3)])
    return listed(v / np.linalg.norm(v))


def listed(v: object) -> list[float]:
    return [float(x) for x in np.asarray(v)]


def towards(chosen: random.Random, target: Floats, distance: float) -> Ray:
    """A ray of some length from a distance, in any direction, through a place."""
    origin = target + distance * np.array(direction(chosen))
    return listed(origin), listed((target - origin) * chosen.uniform(0.2, 3))


def triangles(make: Make, distance: Draw | None = None) -> Family:
    """Rays at triangles and beside them from three times their size, or from a distance."""

    def draw(chosen: random.Random) -> Drawn:
        corners = make(chosen)
        size = max(float(np.linalg.norm(np.array(a) - b)) for a, b in itertools.combinations(corners, 2))

        def ray() -> Ray:
            u, v = (chosen.uniform(-0.3, 1.3) for _ in "uv")
            if chosen.random() < 0.7 and u + v > 1:
                u, v = 1 - u, 1 - v
            target = np.array([1 - u - v, u, v]) @ np.array(corners)
            return towards(chosen, target, distance(chosen) if distance else 3 * size)

        return triangle(*corners), ray

    return family(make.__name__, draw)


def ordinary(chosen: random.Random) -> list[list[float]]:
    return [vector(chosen) for _ in range(3)]


def sliver(chosen: random.Random) -> list[list[float]]:
    """Base 1, height 1e-7 to 1e-2."""
    a, along = np.array(vector(chosen)), np.array(direction(chosen))
    aside = np.cross(along, direction(chosen)) * 10 ** chosen.uniform(-7, -2)
    return [listed(a), listed(a + along), listed(a + chosen.random() * along + aside)]


def offset(chosen: random.Random) -> list[list[float]]:
    """Up to a million units from the origin."""
    place = np.array(vector(chosen, 1e6))
    return [listed(place + vector(chosen)) for _ in range(3)]


def grazing(kind: str) -> Family:
    """Rays that arrive at the plane of a triangle or a rectangle at an angle down to 3e-7."""

    def draw(chosen: random.Random) -> Drawn:
        a, first, second = (np.array(vector(chosen)) for _ in range(3))
        normal = np.cross(first, second) / np.linalg.norm(np.cross(first, second))
        if kind == "rectangle":
            second = np.cross(normal, first)
            shape = rectangle(a, first, second)
        else:
            shape = triangle(a, a + first, a + second)

        def ray() -> Ray:
            target = a + chosen.uniform(-0.3, 1.3) * first + chosen.uniform(-0.3, 1.3) * second
            along = (chosen.uniform(-1, 1) * first + chosen.uniform(-1, 1) * second) * 3
            lifted = along + normal * 10 ** chosen.uniform(-6.5, -1)
            return listed(target - lifted), listed(lifted)

        return shape, ray

    return family(f"grazing {kind}", draw)


def rectangles(make: Make) -> Family:
    """Rays at parallelograms and beside them from three times their size."""

    def draw(chosen: random.Random) -> Drawn:
        corner, first, second = (np.array(part) for part in make(chosen))
        size = float(max(np.linalg.norm(first), np.linalg.norm(second)))

        def ray() -> Ray:
            u, v = chosen.uniform(-0.3, 1.3), chosen.uniform(-0.3, 1.3)
            return towards(chosen, corner + u * first + v * second, 3.0 * size)

        return rectangle(corner, first, second), ray

    return family(make.__name__, draw)


def skew(chosen: random.Random) -> list[list[float]]:
    """Edges at any angle."""
    return [vector(chosen), direction(chosen), direction(chosen)]


def long_and_narrow(chosen: random.Random) -> list[list[float]]:
    """Sides 1 to a million, perpendicular but for what float32 files round."""
    first = np.array(direction(chosen))
    second = (np.cross(first, direction(chosen)) * 1e-6).astype(np.float32)
    return [vector(chosen), listed(first), listed(second)]


def any_size(chosen: random.Random) -> list[list[float]]:
    """Of size 1e-15 to 1e15, from the smallest to the largest of a scene."""
    size = 10 ** chosen.uniform(-15, 15)
    return [vector(chosen, size) for _ in range(3)]


def axes_near_one(chosen: random.Random) -> list[float]:
    return [chosen.uniform(0.3, 2) for _ in range(3)]


def axes_far_apart(chosen: random.Random) -> list[float]:
    """Semi-axes down to a millionth of the first."""
    return [1.0, 10 ** chosen.uniform(-2, 0), 10 ** chosen.uniform(-6, -3)]


def turned_axes(chosen: random.Random, lengths: list[float]) -> Floats:
    """Semi-axes of these lengths in random directions, one a row."""
    rows, _ = np.linalg.qr(np.array([direction(chosen) for _ in range(3)]))
    return rows * np.array(lengths)[:, None]


def aimed(
    name: str,
    axes: Callable[[random.Random], list[float]],
    *,
    center: Draw = ONE,
    distance: Draw = NEAR,
    length: Draw = ONE,
) -> Family:
    """Rays at places inside and beside ellipsoids, that start some times the longest semi-axis from there."""

    def draw(chosen: random.Random) -> Drawn:
        scaled = turned_axes(chosen, axes(chosen))
        middle = np.array(vector(chosen, center(chosen)))
        size = float(np.linalg.norm(scaled, axis=1).max())

        def ray() -> Ray:
            target = middle + np.array(direction(chosen)) * chosen.uniform(0, 1.4) @ scaled
            origin = middle + distance(chosen) * size * np.array(direction(chosen))
            return listed(origin), listed((target - origin) * length(chosen))

        return ellipsoid(middle, *scaled), ray

    return family(name, draw)


def far_and_tiny(chosen: random.Random) -> Drawn:
    """Spheres of radius 1, from 1e3 to 3e6 units away."""
    distance = 10 ** chosen.uniform(3, 6.5)
    middle = distance * np.array(direction(chosen))

    def ray() -> Ray:
        target = middle + np.array(direction(chosen)) * chosen.uniform(0, 1.3)
        return vector(chosen), listed(target / distance)

    return sphere(listed(middle), 1.0), ray


def ground(chosen: random.Random) -> Drawn:
    """A giant sphere as the ground, seen from two units above it."""
    radius = 10 ** chosen.uniform(5, 7)

    def ray() -> Ray:
        x, y, _ = vector(chosen)
        return [chosen.uniform(-5, 5), 2.0, chosen.uniform(-5, 5)], [x, -abs(y), -0.3]

    return sphere([0.0, -radius, 0.0], radius), ray


def near_the_surface(chosen: random.Random) -> Drawn:
    """Starts on both sides of the surface, by 1e-6 to a tenth of the semi-axes; any direction."""
    scaled = turned_axes(chosen, axes_near_one(chosen))
    middle = np.array(vector(chosen))

    def ray() -> Ray:
        depth = chosen.choice([-1, 1]) * 10 ** chosen.uniform(-6, -1)
        return listed(middle + (1 + depth) * np.array(direction(chosen)) @ scaled), direction(chosen)

    return ellipsoid(middle, *scaled), ray


def nearly_tangent(chosen: random.Random) -> Drawn:
    """Rays that pass a sphere at 1 +- 1e-7 to 1e-1 radii."""
    middle = np.array(vector(chosen))

    def ray() -> Ray:
        along, aside = np.array(direction(chosen)), np.array(direction(chosen))
        aside -= along * (aside @ along)
        aside /= np.linalg.norm(aside)
        approach = 1 + chosen.choice([-1, 1]) * 10 ** chosen.uniform(-7, -1)
        return listed(middle + approach * aside - chosen.uniform(2, 9) * along), listed(along)

    return sphere(listed(middle), 1.0), ray


def flat_from_outside(chosen: random.Random) -> Drawn:
    """Flat ellipsoids, half of them with mirrored axes; rays near the normals, many at the rim."""
    scaled = turned_axes(chosen, [1.0, 1.0, 10 ** chosen.uniform(-6, -2)])
    scaled[chosen.randrange(3)] *= chosen.choice([-1, 1])
    rows = scaled / (scaled * scaled).sum(axis=1)[:, None]
    middle = np.array(vector(chosen))

    def ray() -> Ray:
        place = np.array(direction(chosen))
        upright = place @ rows / np.linalg.norm(place @ rows)
        way = upright + 0.5 * np.array(direction(chosen))
        return listed(middle + place @ scaled + 3 * way), listed(-way)

    return ellipsoid(middle, *scaled), ray
