"""Rectangles and parallelograms against rational numbers; shared corners and edges; those without area."""

import itertools

import numpy as np
import pytest

from renderer.shapes.rectangles import from_edges
from tests.documents import rectangle, scene
from tests.numerics import families
from tests.numerics.families import rectangles
from tests.numerics.judging import assert_right, flat_details, rounded
from tests.numerics.tracing import problems, rays_of, traced

FAMILIES = {
    "skew": lambda: rectangles(families.skew),
    "long and narrow": lambda: rectangles(families.long_and_narrow),
    "of any size": lambda: rectangles(families.any_size),
    "grazing": lambda: families.grazing("rectangle"),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_rectangle_is_hit_as_exact_numbers_say(name: str) -> None:
    assert_right(FAMILIES[name](), flat_details, rounded)


@pytest.mark.parametrize("skew", [False, True], ids=["of a room", "skew"])
def test_corner_of_two_walls_lets_no_ray_through(skew: bool) -> None:
    """Perpendicular as float32 files hold it, or at any angle; corner and edge are shared bit for bit."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        edges = rng.normal(size=(3, 3))
        if not skew:
            edges = np.linalg.qr(edges)[0].astype(np.float32).astype(float)
        corner, (shared, left, right) = rng.normal(size=3), edges
        origin = corner + 0.5 * shared + 0.7 * left + 0.7 * right
        targets = corner + np.outer(rng.uniform(0.01, 0.99, 20), shared)
        walls = [rectangle(corner, shared, other) for other in (left, right)]
        hits = traced(walls, np.broadcast_to(origin, targets.shape), targets - origin)
        assert (hits.shape >= 0).all()


def test_sheet_of_parallelograms_lets_no_exact_ray_through() -> None:
    """Four around a corner, in whole numbers: rays hit edges and that corner without any rounding."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        corner, first, second = rng.integers(-20, 21, (3, 3)) * 8.0
        shares = np.stack((np.ones(40), rng.integers(1, 9, 40) / 8), axis=1)
        shares[::2] = shares[::2, ::-1]
        targets, ways = corner + shares @ np.array([first, second]), rng.integers(-160, 161, (40, 3))
        across = ways @ np.cross(first, second) != 0
        places = [corner + i * first + j * second for i, j in itertools.product((0, 1), repeat=2)]
        shapes = [rectangle(place, first, second) for place in places]
        hits = traced(shapes, (targets - 3 * ways)[across], 3.0 * ways[across])
        assert (hits.shape >= 0).all()


def test_rectangle_without_area_is_refused_and_never_hit() -> None:
    """Edges of no length, or one a multiple of the other; and a tangent along the normal."""
    rng = np.random.default_rng(2)
    corners, first = rng.integers(-20, 21, (2, 100, 3)) * 1.0
    second = first * rng.integers(-3, 4, (100, 1))
    first[::3] = 0
    card = {"center": [0, 0, 0], "normal": [1, 2, 3], "tangent": [2, 4, 6], "size": [1, 1]}
    assert problems(scene({"type": "rectangle", **card, "material": "plain"})) == ["/shapes/0/tangent"]
    for rows in np.stack((corners, first, second), 1)[:40]:
        assert {pointer[:15] for pointer in problems(scene(rectangle(*rows)))} == {"/shapes/0/edges"}
    origins = rng.normal(size=(100, 3)) * 50
    family = from_edges(np.arange(100), *(part.T.copy() for part in (corners, first, second)))
    rays = rays_of(origins.T.copy(), (corners - origins).T)
    for number in range(100):
        family.intersect(number, rays)
    assert (rays.t == np.inf).all()
