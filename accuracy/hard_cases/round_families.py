"""Seeded families of rays at ellipsoids, each hard in one way."""

import random
from collections.abc import Callable, Iterator

import numpy as np

from accuracy.hard_cases.documents import ellipsoid, sphere
from accuracy.hard_cases.draws import Case, Ray, direction, listed, vector

SHAPES, RAYS = 50, 20
"""Of a family: a thousand rays."""

Draw = Callable[[random.Random], float]
Axes = Callable[[random.Random], list[float]]


def between(low: float, high: float) -> Draw:
    """Ten to a power between these: all sizes alike."""
    return lambda chosen: 10 ** chosen.uniform(low, high)


ONE = between(0, 0)
NEAR = between(0.5, 0.5)


def axes_near_one(chosen: random.Random) -> list[float]:
    """Semi-axes of 0.3 to 2."""
    return [chosen.uniform(0.3, 2) for _ in range(3)]


def axes_far_apart(chosen: random.Random) -> list[float]:
    """Semi-axes down to a millionth of the first."""
    return [1.0, 10 ** chosen.uniform(-2, 0), 10 ** chosen.uniform(-6, -3)]


def turned(chosen: random.Random, lengths: list[float]) -> np.ndarray:
    """Semi-axes of these lengths in random directions, one a row."""
    rows, _ = np.linalg.qr(np.array([direction(chosen) for _ in range(3)]))
    return rows * np.array(lengths)[:, None]


def aimed(name: str, axes: Axes, *, center: Draw = ONE, distance: Draw = NEAR) -> Iterator[Case]:
    """Rays at places inside and beside ellipsoids, that start some times the longest semi-axis from there."""
    chosen = random.Random(name)
    for _ in range(SHAPES):
        scaled = turned(chosen, axes(chosen))
        middle = np.array(vector(chosen, center(chosen)))
        size = float(np.linalg.norm(scaled, axis=1).max())
        rays = []
        for _ in range(RAYS):
            target = middle + np.array(direction(chosen)) * chosen.uniform(0, 1.4) @ scaled
            origin = middle + distance(chosen) * size * np.array(direction(chosen))
            rays.append((listed(origin), listed((target - origin) * chosen.uniform(0.2, 3))))
        yield ellipsoid(listed(middle), *map(listed, scaled)), rays


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
        rays: list[Ray] = []
        for _ in range(RAYS):
            x, y, _ = vector(chosen)
            rays.append(([chosen.uniform(-5, 5), 2.0, chosen.uniform(-5, 5)], [x, -abs(y), -0.3]))
        yield sphere([0.0, -radius, 0.0], radius), rays


def near_the_surface(name: str, depth: Draw, *, outside: bool = False) -> Iterator[Case]:
    """Starts below the surface, or on both sides of it, by a share of the semi-axes; any direction."""
    chosen = random.Random(name)
    for _ in range(SHAPES):
        scaled = turned(chosen, axes_near_one(chosen))
        middle = np.array(vector(chosen))
        rays = []
        for _ in range(RAYS):
            side = chosen.choice([-1, 1]) if outside else -1
            origin = middle + (1 + side * depth(chosen)) * np.array(direction(chosen)) @ scaled
            rays.append((listed(origin), direction(chosen)))
        yield ellipsoid(listed(middle), *map(listed, scaled)), rays


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


def flat_from_outside() -> Iterator[Case]:
    """Flat ellipsoids, half of them with mirrored axes, and rays that arrive near the normals.

    The places are spread alike over the unit sphere: many are near the rim.
    """
    chosen = random.Random("flat")
    for _ in range(SHAPES):
        scaled = turned(chosen, [1.0, 1.0, 10 ** chosen.uniform(-6, -2)])
        scaled[chosen.randrange(3)] *= chosen.choice([-1, 1])
        rows = scaled / (scaled * scaled).sum(axis=1)[:, None]
        middle, rays = np.array(vector(chosen)), []
        for _ in range(RAYS):
            place = np.array(direction(chosen))
            upright = place @ rows / np.linalg.norm(place @ rows)
            way = upright + 0.5 * np.array(direction(chosen))
            rays.append((listed(middle + place @ scaled + 3 * way), listed(-way)))
        yield ellipsoid(listed(middle), *map(listed, scaled)), rays


def behind() -> Iterator[Case]:
    """Starts outside, and looks away from the centre: both roots are negative."""
    chosen = random.Random("behind")
    for _ in range(SHAPES):
        scaled = turned(chosen, axes_near_one(chosen))
        middle, rays = np.array(vector(chosen)), []
        for _ in range(RAYS):
            place, along = np.array(direction(chosen)), np.array(direction(chosen))
            along *= np.copysign(1.0, along @ place)
            origin = middle + (1 + 10 ** chosen.uniform(-12, 2)) * place @ scaled
            rays.append((listed(origin), listed(along @ scaled)))
        yield ellipsoid(listed(middle), *map(listed, scaled)), rays


def of_any_length(name: str, low: float, high: float) -> Iterator[Case]:
    """Ordinary rays with directions 10 to a power between these long."""
    chosen = random.Random(name)
    for shape, rays in aimed(name, axes_near_one):
        yield shape, [(o, listed(np.array(d) * 10 ** chosen.uniform(low, high))) for o, d in rays]


def along_axes() -> Iterator[Case]:
    """Directions with one or two components of 0 or -0."""
    chosen = random.Random("zeros")
    for _ in range(SHAPES):
        scaled = turned(chosen, axes_near_one(chosen))
        middle, rays = np.array(vector(chosen)), []
        for _ in range(RAYS):
            along = np.array(direction(chosen))
            along[chosen.sample(range(3), chosen.choice([1, 2]))] = chosen.choice([0.0, -0.0])
            target = middle + np.array(direction(chosen)) * chosen.uniform(0, 1.2) @ scaled
            rays.append((listed(target - 5 * along / np.abs(along).max()), listed(along)))
        yield ellipsoid(listed(middle), *map(listed, scaled)), rays


ROUND: dict[str, Callable[[], Iterator[Case]]] = {
    "ellipsoids with axes far apart": lambda: aimed("far apart", axes_far_apart),
    "thin ellipsoids seen from far away": lambda: aimed(
        "thin and far", axes_far_apart, distance=between(6, 12)
    ),
    "ellipsoids far from the origin": lambda: aimed("far away", axes_near_one, center=between(2, 12)),
    "tiny spheres far away": far_and_tiny,
    "the ground": ground,
    "from inside an ellipsoid": lambda: near_the_surface("inside", between(-6, 0)),
    "from close to an ellipsoid": lambda: near_the_surface("close", between(-6, -1), outside=True),
    "flat ellipsoids from outside": flat_from_outside,
    "nearly tangent": nearly_tangent,
    "ellipsoids behind": behind,
    "directions with zeros": along_axes,
    "long and short directions": lambda: of_any_length("lengths", -30, 25),
}
