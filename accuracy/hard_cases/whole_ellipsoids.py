"""Ellipsoids and places of whole numbers times powers of two, which places lie on exactly."""

import random
from collections.abc import Iterator

import numpy as np

from accuracy.hard_cases.documents import Json, ellipsoid
from accuracy.hard_cases.draws import Case, direction, listed
from accuracy.hard_cases.round_families import RAYS, SHAPES

RADIUS = 25.0
ON_SPHERE = [(7, 24, 0), (15, 20, 0), (9, 12, 20), (12, 15, 16), (25, 0, 0)]
"""Whole numbers whose squares add up to that of the radius."""


def on_the_surface(chosen: random.Random) -> tuple[Json, np.ndarray, np.ndarray]:
    """An ellipsoid, a place exactly on it, and a vector along the normal there, (3,) each."""
    i, j, k, real = (chosen.randint(low, 3) for low in (-3, -3, -3, 1))
    rows = turned(i, j, k, real)
    place = np.array(chosen.sample(chosen.choice(ON_SPHERE), 3)) * [chosen.choice([-1, 1]) for _ in range(3)]
    middle = np.array([chosen.randint(-50, 50) for _ in range(3)])
    powers = 2.0 ** np.array([chosen.randint(-3, 3) for _ in range(3)])
    axes = RADIUS * powers[:, None] * rows
    shape = ellipsoid(listed(middle), *map(listed, axes))
    return shape, middle + (place * powers) @ rows, (place / powers) @ rows


def turned(a: int, b: int, c: int, d: int) -> np.ndarray:
    """Three perpendicular vectors of whole numbers, all as long: Euler's parametrisation of rotations."""
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )


def exactly_tangent_rays() -> Iterator[Case]:
    """Rays in tangent planes through the place where these touch, from up to some million radii away."""
    chosen = random.Random("exactly tangent")
    for _ in range(SHAPES):
        shape, place, normal = on_the_surface(chosen)
        rays = []
        for _ in range(RAYS):
            along = np.cross(normal, [chosen.randint(-9, 9) for _ in range(3)])
            along = along if along.any() else np.cross(normal, normal[[1, 2, 0]])
            rays.append((listed(place - 2.0 ** chosen.randint(0, 16) * along), listed(along)))
        yield shape, rays


def from_the_surface() -> Iterator[Case]:
    """Rays in all directions from places exactly on ellipsoids."""
    chosen = random.Random("from the surface")
    for _ in range(SHAPES):
        shape, place, _ = on_the_surface(chosen)
        yield shape, [(listed(place), direction(chosen)) for _ in range(RAYS)]
