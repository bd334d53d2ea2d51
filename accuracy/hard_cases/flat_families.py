"""Seeded families of rays at flat shapes, each hard in one way."""

import itertools
import random
from collections.abc import Callable, Iterator

import numpy as np

from accuracy.hard_cases.documents import Json, rectangle, triangle
from accuracy.hard_cases.draws import Case, Ray, direction, listed, vector

SHAPES, RAYS = 100, 10
"""Of a family: a thousand rays, at many shapes rather than many at one."""


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
    """Coordinates up to 1e15, the largest of a scene."""
    return [vector(chosen, 1e15) for _ in range(3)]


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
        if kind == "rectangle":
            second = np.cross(normal, first)
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


def long_and_narrow(chosen: random.Random) -> list[list[float]]:
    """Sides 1 to a million, perpendicular but for what float32 files round."""
    first = np.array(direction(chosen))
    second = (np.cross(first, direction(chosen)) * 1e-6).astype(np.float32)
    return [vector(chosen), listed(first), listed(second)]


def any_size(chosen: random.Random) -> list[list[float]]:
    """Perpendicular edges, of size 1e-12 to 1e12."""
    size = 10 ** chosen.uniform(-12, 12)
    corner, first, second = (size * np.array(vector(chosen)) for _ in range(3))
    second -= first * (first @ second) / (first @ first)
    return [listed(corner), listed(first), listed(second)]


FLAT: dict[str, Callable[[], Iterator[Case]]] = {
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
    "long and narrow rectangles": lambda: rectangles(long_and_narrow),
    "rectangles of any size": lambda: rectangles(any_size),
}
