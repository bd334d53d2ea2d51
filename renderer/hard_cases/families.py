"""Seeded families of rays, each hard in one way: a shape and rays to try on it."""

import random
from collections.abc import Callable, Iterator

import numpy as np

from renderer.hard_cases.documents import ellipsoid, sphere
from renderer.hard_cases.draws import Case, direction, listed, vector
from renderer.hard_cases.flat_families import FLAT

SHAPES, RAYS = 30, 10


def round_(
    name: str, axes: Callable[[random.Random], list[float]], center: float = 1.0, distance: float = 3.0
) -> Iterator[Case]:
    """Ellipsoids with semi-axes of given lengths in random directions."""
    chosen = random.Random(name)
    for _ in range(SHAPES):
        turned, _ = np.linalg.qr(np.array([direction(chosen) for _ in range(3)]))
        scaled = [listed(axis * length) for axis, length in zip(turned, axes(chosen), strict=True)]
        middle = np.array(vector(chosen, center))
        size = max(float(np.linalg.norm(axis)) for axis in scaled)
        rays = []
        for _ in range(RAYS):
            weights = np.array(direction(chosen)) * chosen.uniform(0, 1.4)
            target = middle + weights @ np.array(scaled)
            origin = middle + distance * size * np.array(direction(chosen))
            rays.append((listed(origin), listed((target - origin) * chosen.uniform(0.2, 3))))
        yield ellipsoid(listed(middle), *scaled), rays


def axes_near_one(chosen: random.Random) -> list[float]:
    """Semi-axes of 0.3 to 2."""
    return [chosen.uniform(0.3, 2) for _ in range(3)]


def axes_far_apart(chosen: random.Random) -> list[float]:
    """Semi-axes down to a millionth of the first."""
    return [1.0, 10 ** chosen.uniform(-2, 0), 10 ** chosen.uniform(-6, -3)]


def far_and_tiny() -> Iterator[Case]:
    """Spheres of radius 1, from 1e3 to 3e6 units away."""
    chosen = random.Random("far and tiny")
    for _ in range(SHAPES):
        distance = 10 ** chosen.uniform(3, 6.5)
        middle = distance * np.array(direction(chosen))
        rays = []
        for _ in range(RAYS):
            target = middle + np.array(direction(chosen)) * chosen.uniform(0, 1.3)
            rays.append((vector(chosen), listed(target / distance)))
        yield sphere(listed(middle), 1.0), rays


def ground() -> Iterator[Case]:
    """A giant sphere as the ground, seen from two units above it."""
    chosen = random.Random("ground")
    for _ in range(SHAPES):
        radius = 10 ** chosen.uniform(5, 7)
        rays = [
            ([chosen.uniform(-5, 5), 2.0, chosen.uniform(-5, 5)], [*vector(chosen)[:2], -0.3])
            for _ in range(RAYS)
        ]
        yield sphere([0.0, -radius, 0.0], radius), [(o, [d[0], -abs(d[1]), d[2]]) for o, d in rays]


def inside() -> Iterator[Case]:
    """Starts below the skin by a share of 1 to 1e-6."""
    chosen = random.Random("inside")
    for _ in range(SHAPES):
        turned, _ = np.linalg.qr(np.array([direction(chosen) for _ in range(3)]))
        scaled = [listed(axis * chosen.uniform(0.3, 2)) for axis in turned]
        middle = np.array(vector(chosen))
        rays = []
        for _ in range(RAYS):
            depth = 10 ** chosen.uniform(-6, 0)
            origin = middle + (1 - depth) * np.array(direction(chosen)) @ np.array(scaled)
            rays.append((listed(origin), direction(chosen)))
        yield ellipsoid(listed(middle), *scaled), rays


def nearly_tangent() -> Iterator[Case]:
    """Rays that pass a sphere at 1 +- 1e-7 to 1e-1 radii."""
    chosen = random.Random("tangent")
    for _ in range(SHAPES):
        middle, rays = np.array(vector(chosen)), []
        for _ in range(RAYS):
            along, aside = np.array(direction(chosen)), np.array(direction(chosen))
            aside -= along * (aside @ along)
            aside /= np.linalg.norm(aside)
            approach = 1 + chosen.choice([-1, 1]) * 10 ** chosen.uniform(-7, -1)
            rays.append((listed(middle + approach * aside - chosen.uniform(2, 9) * along), listed(along)))
        yield sphere(listed(middle), 1.0), rays


FAMILIES: dict[str, Callable[[], Iterator[Case]]] = {
    **FLAT,
    "ellipsoids": lambda: round_("near one", axes_near_one),
    "ellipsoids with axes far apart": lambda: round_("far apart", axes_far_apart),
    "ellipsoids far from the origin": lambda: round_("far away", axes_near_one, center=1e6),
    "tiny spheres far away": far_and_tiny,
    "the ground": ground,
    "from inside an ellipsoid": inside,
    "nearly tangent": nearly_tangent,
}
