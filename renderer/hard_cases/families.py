"""Seeded families of rays, each hard in one way: a shape and rays to try on it."""

import itertools
import random
from collections.abc import Callable, Iterator

import numpy as np

from renderer.hard_cases.documents import Json, ellipsoid, rectangle, sphere, triangle

Ray = tuple[list[float], list[float]]
Case = tuple[Json, list[Ray]]
SHAPES, RAYS = 30, 10


def vector(chosen: random.Random, reach: float = 1.0) -> list[float]:
    """A random place in a cube."""
    return [chosen.uniform(-reach, reach) for _ in range(3)]


def direction(chosen: random.Random) -> list[float]:
    """A random unit vector."""
    v = np.array([chosen.gauss(0, 1) for _ in range(3)])
    return [float(x) for x in v / np.linalg.norm(v)]


def listed(v: object) -> list[float]:
    """As a scene writes it."""
    return [float(x) for x in np.asarray(v)]


def mixed(corners: list[list[float]], weights: list[float]) -> np.ndarray:
    """The sum of corners by weights."""
    return sum(w * np.array(c) for w, c in zip(weights, corners, strict=True))  # type: ignore[return-value]


def aimed(chosen: random.Random, corners: list[list[float]], distance: float, spread: float = 0.3) -> Ray:
    """A ray at a random place of a triangle of corners, or somewhat beside it."""
    u, v = (chosen.uniform(-spread, 1 + spread) for _ in "uv")
    if chosen.random() < 0.7 and u + v > 1:
        u, v = 1 - u, 1 - v
    target = mixed(corners, [1 - u - v, u, v])
    origin = target + distance * np.array(direction(chosen))
    return listed(origin), listed((target - origin) * chosen.uniform(0.2, 3))


def triangles(make: Callable[[random.Random], list[list[float]]], distance: float = 3.0) -> Iterator[Case]:
    """A family of triangles, with rays at them and beside them from some sizes away."""
    chosen = random.Random(make.__name__)
    for _ in range(SHAPES):
        corners = make(chosen)
        size = max(float(np.linalg.norm(np.array(a) - b)) for a, b in itertools.combinations(corners, 2))
        yield triangle(*corners), [aimed(chosen, corners, distance * size) for _ in range(RAYS)]


def ordinary(chosen: random.Random) -> list[list[float]]:
    """Of no special shape."""
    return [vector(chosen) for _ in range(3)]


def sliver(chosen: random.Random) -> list[list[float]]:
    """Base 1, height 1e-7 to 1e-2."""
    a, along = np.array(vector(chosen)), np.array(direction(chosen))
    aside = np.cross(along, direction(chosen)) * 10 ** chosen.uniform(-7, -2)
    return [listed(a), listed(a + along), listed(a + chosen.random() * along + aside)]


def needle(chosen: random.Random) -> list[list[float]]:
    """Two vertices 1e-6 apart, the third at distance 1."""
    a = np.array(vector(chosen))
    return [listed(a), listed(a + 1e-6 * np.array(direction(chosen))), listed(a + direction(chosen))]


def tiny(chosen: random.Random) -> list[list[float]]:
    """Of size 1e-15 to 1e-4."""
    size = 10 ** chosen.uniform(-15, -4)
    return [listed(size * np.array(vector(chosen))) for _ in range(3)]


def huge(chosen: random.Random) -> list[list[float]]:
    """Coordinates up to 1e14."""
    return [vector(chosen, 1e14) for _ in range(3)]


def offset(chosen: random.Random) -> list[list[float]]:
    """Up to a million units from the origin."""
    place = np.array(vector(chosen, 1e6))
    return [listed(place + vector(chosen)) for _ in range(3)]


def long_rays() -> Iterator[Case]:
    """From 1e3 to 3e6 units away."""
    chosen = random.Random("long")
    for _ in range(SHAPES):
        corners = ordinary(chosen)
        yield triangle(*corners), [aimed(chosen, corners, 10 ** chosen.uniform(3, 6.5)) for _ in range(RAYS)]


def grazing(kind: str) -> Iterator[Case]:
    """Rays that meet the plane at an angle down to 3e-7."""
    chosen = random.Random(f"grazing {kind}")
    for _ in range(SHAPES):
        a, first, second = (np.array(vector(chosen)) for _ in range(3))
        normal = np.cross(first, second) / np.linalg.norm(np.cross(first, second))
        rays = []
        for _ in range(RAYS):
            target = a + chosen.uniform(-0.3, 1.3) * first + chosen.uniform(-0.3, 1.3) * second
            along = (chosen.uniform(-1, 1) * first + chosen.uniform(-1, 1) * second) * 3
            lifted = along + normal * 10 ** chosen.uniform(-6.5, -1)
            rays.append((listed(target - lifted), listed(lifted)))
        yield flat(kind, a, first, second), rays


def flat(kind: str, a: np.ndarray, first: np.ndarray, second: np.ndarray) -> Json:
    """A triangle or a parallelogram of two edges."""
    if kind == "triangle":
        return triangle(listed(a), listed(a + first), listed(a + second))
    return rectangle(listed(a), listed(first), listed(second))


def rectangles(make: Callable[[random.Random], list[list[float]]], distance: float = 3.0) -> Iterator[Case]:
    """A family of parallelograms, with rays at them and beside them."""
    chosen = random.Random(make.__name__)
    for _ in range(SHAPES):
        corner, first, second = make(chosen)
        size = float(max(np.linalg.norm(first), np.linalg.norm(second)))
        rays = []
        for _ in range(RAYS):
            u, v = chosen.uniform(-0.3, 1.3), chosen.uniform(-0.3, 1.3)
            target = np.array(corner) + u * np.array(first) + v * np.array(second)
            origin = target + distance * size * np.array(direction(chosen))
            rays.append((listed(origin), listed((target - origin) * chosen.uniform(0.2, 3))))
        yield rectangle(corner, first, second), rays


def skew(chosen: random.Random) -> list[list[float]]:
    """Edges at any angle."""
    return [vector(chosen), direction(chosen), direction(chosen)]


def square_in_float32(chosen: random.Random) -> list[list[float]]:
    """Perpendicular edges, rounded as float32 files hold them."""
    first, other = np.array(direction(chosen)), np.array(direction(chosen))
    second = np.cross(first, other)
    return [vector(chosen), listed(first.astype(np.float32)), listed(second.astype(np.float32))]


def long_and_narrow(chosen: random.Random) -> list[list[float]]:
    """Sides 1 to a million."""
    first = np.array(direction(chosen))
    return [vector(chosen), listed(first), listed(np.cross(first, direction(chosen)) * 1e-6)]


def any_size(chosen: random.Random) -> list[list[float]]:
    """Of size 1e-12 to 1e12."""
    size = 10 ** chosen.uniform(-12, 12)
    return [listed(size * np.array(vector(chosen))) for _ in range(3)]


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
    "triangles": lambda: triangles(ordinary),
    "slivers": lambda: triangles(sliver),
    "needles": lambda: triangles(needle),
    "tiny triangles": lambda: triangles(tiny),
    "huge triangles": lambda: triangles(huge),
    "triangles far from the origin": lambda: triangles(offset),
    "long rays": long_rays,
    "triangles at a grazing angle": lambda: grazing("triangle"),
    "rectangles at a grazing angle": lambda: grazing("rectangle"),
    "skew parallelograms": lambda: rectangles(skew),
    "rectangles rounded to float32": lambda: rectangles(square_in_float32),
    "long and narrow rectangles": lambda: rectangles(long_and_narrow),
    "rectangles of any size": lambda: rectangles(any_size),
    "ellipsoids": lambda: round_("near one", axes_near_one),
    "ellipsoids with axes far apart": lambda: round_("far apart", axes_far_apart),
    "ellipsoids far from the origin": lambda: round_("far away", axes_near_one, center=1e6),
    "tiny spheres far away": far_and_tiny,
    "the ground": ground,
    "from inside an ellipsoid": inside,
    "nearly tangent": nearly_tangent,
}
