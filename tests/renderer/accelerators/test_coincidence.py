"""Pairs of shapes in one place are those that a comparison of all with all finds."""

from collections.abc import Callable
from itertools import combinations_with_replacement

import numpy as np
import pytest

from renderer.shapes import Family
from tests.documents import Json, ellipsoid, mesh, rectangle, scene, triangle
from tests.pictures.parts import plan_of

Random = np.random.Generator


def flat_shapes(chosen: Random, widths: tuple[float, ...] = (1.0,), size: float = 8.0) -> list[Json]:
    """Half of them in a few planes that no double is exact in, half across each other, some without area."""
    planes = [(np.linalg.qr(chosen.normal(size=(3, 3)))[0], chosen.uniform(-9, 9, 3)) for _ in range(4)]
    shapes = []
    for _ in range(150):
        axes, place = (
            planes[chosen.integers(4)] if chosen.random() < 0.5 else (np.eye(3), chosen.normal(size=3))
        )
        reach, width = size * chosen.uniform(0.3, 1, 2) * np.array([1, chosen.choice(widths)])
        corner = place + chosen.uniform(-4, 4, 2) @ axes[:2]
        first, second = reach * axes[0], width * axes[1]
        turned = [corner, corner + first, corner + second]
        if axes[0, 0] == 1:
            turned = chosen.normal(0, size, (3, 3))
        made = [
            triangle(*turned),
            rectangle(corner, first, second),
            mesh([*turned, corner], [[0, 2, 1], [0, 0, 1], [0, 3, 1]]),
        ]
        shapes.append(made[chosen.integers(3)])
    return shapes


def uneven_shapes(chosen: Random) -> list[Json]:
    """Slivers, specks, and floors of all sizes."""
    return flat_shapes(chosen, (1e-9, 1e-4, 1.0, 1.0), 8.0) + flat_shapes(chosen, size=1e5)[:40]


def round_shapes(chosen: Random) -> list[Json]:
    """In each other, and some of them the same but for roundings."""
    centers, shapes = chosen.uniform(-99, 99, (4, 3)), []
    for _ in range(60):
        center = centers[chosen.integers(4)] + chosen.choice([0.0, 0.0, 1e-9, 0.1]) * chosen.normal(size=3)
        radius = chosen.choice([0.5, 0.5, 0.5 + 1e-9, 20.0])
        axes = np.linalg.qr(chosen.normal(size=(3, 3)))[0]
        shapes.append(ellipsoid(center, *(radius * axes)))
    return shapes


def compared(families: tuple[Family, ...]) -> set[tuple[int, int]]:
    """Numbers among all of the primitives of different shapes that coincide, the later shape's first."""
    begins = np.cumsum([0, *(family.numbers.size for family in families)])
    found = set()
    for i, j in combinations_with_replacement(range(len(families)), 2):
        a, b = families[i], families[j]
        if a.surface != b.surface:
            continue
        own, others = (part.ravel() for part in np.indices((a.numbers.size, b.numbers.size)))
        chosen = a.numbers[own] < b.numbers[others] if i == j else a.numbers[own] != b.numbers[others]
        own, others = own[chosen], others[chosen]
        together = a.coincide(own, b, others)
        for x, y in zip(own[together].tolist(), others[together].tolist(), strict=True):
            pair = (begins[i] + x, begins[j] + y)
            found.add(pair if a.numbers[x] > b.numbers[y] else pair[::-1])
    return found


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [flat_shapes, uneven_shapes, round_shapes])
def test_shapes_in_one_place_are_found(make: Callable[[Random], list[Json]], seed: int) -> None:
    geometry = plan_of(scene(*make(np.random.default_rng(seed)))).geometry
    expected = compared(geometry.families)
    count = sum(family.numbers.size for family in geometry.families)
    assert len(expected) > 10
    assert geometry.overlaps is not None
    pairs = geometry.overlaps.pairs
    assert {*zip((pairs // count).tolist(), (pairs % count).tolist(), strict=True)} == expected
