"""Faces as triangles, against exact areas and points inside."""

import math
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np
import pytest

from renderer.assets import AssetError
from renderer.meshes.triangulation import MOST_CORNERS, triangulate

Ring = list[tuple[int, int]]


def twice_area(ring: Any) -> int:
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(ring, [*ring[1:], ring[0]], strict=True))


def star(random: Random, points: int) -> Ring:
    turns = [2 * math.pi * i / points for i in range(points)]
    radii = [random.uniform(50, 1000) for _ in turns]
    return [(round(r * math.cos(a)), round(r * math.sin(a))) for a, r in zip(turns, radii, strict=True)]


def spiral(random: Random, points: int) -> Ring:
    out = [(100 + 30 * i, 0.5 * i) for i in range(points)]
    polar = [*out, *((r + random.uniform(5, 25), a) for r, a in reversed(out))]
    return [(round(r * math.cos(a)), round(r * math.sin(a))) for r, a in polar]


def skyline(random: Random, points: int) -> Ring:
    """Has many corners on straight edges."""
    heights = [random.randint(1, 3) for _ in range(points) for _ in range(random.randint(1, 3))]
    bottom = [(x, 0) for x in range(len(heights) + 1)]
    top = [corner for x, h in enumerate(heights) for corner in ((x, h), (x + 1, h))]
    ring = [*bottom, *reversed(top)]
    return [corner for corner, before in zip(ring, [ring[-1], *ring], strict=False) if corner != before]


def lifted(random: Random, ring: Ring) -> np.ndarray[Any, Any]:
    """The ring in a tilted plane, its coordinates in any order; whole numbers stay exact."""
    tilts = random.randint(-3, 3), random.randint(-3, 3)
    points = np.array([(x, y, tilts[0] * x + tilts[1] * y) for x, y in ring], dtype=float)
    return points[:, random.sample(range(3), 3)]


def inside(x: Fraction, y: Fraction, ring: Any) -> bool:
    crossed = False
    for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]], strict=True):
        crossed ^= (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / Fraction(by - ay)
    return crossed


@pytest.mark.parametrize("shape", [star, spiral, skyline])
def test_face_is_covered_once(shape: Any) -> None:
    random = Random(3)
    rings = [shape(random, random.randint(4, 9)) for _ in range(60)]
    rings = [ring[::-1] if random.random() < 0.5 else ring for ring in rings]
    rings = [ring[start:] + ring[:start] for ring in rings for start in [random.randrange(len(ring))]]
    points = np.concatenate([lifted(random, ring) for ring in rings])
    triangles, faces = triangulate(points, np.array([len(ring) for ring in rings]))
    corners = [corner for ring in rings for corner in ring]
    assert (np.diff(faces) >= 0).all()
    for face, ring in enumerate(rings):
        cut = [[corners[i] for i in triangle] for triangle in triangles[faces == face].tolist()]
        assert {corner for triangle in cut for corner in triangle} == set(ring)
        assert all(twice_area(triangle) * twice_area(ring) > 0 for triangle in cut)
        assert sum(map(twice_area, cut)) == twice_area(ring)
        low, high = np.min(ring, axis=0).tolist(), np.max(ring, axis=0).tolist()
        for _ in range(20):
            # No edge between whole numbers goes through: the parts after the point are odd.
            x, y = (
                a + (b - a) * Fraction(random.randrange(9973), 9973) + Fraction(1, 7919)
                for a, b in zip(low, high, strict=True)
            )
            assert sum(inside(x, y, triangle) for triangle in cut) == inside(x, y, ring)


def test_face_fan_stays_where_it_is_right() -> None:
    square = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    arrow = [(2, 0, 0), (0.5, 0.5, 0), (0, 2, 0), (0, 0, 0)]  # only the other diagonal is inside
    hole = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
    keyhole = [(x, y, 7) for x, y in hole]
    line = [(float(i), 0, 0) for i in range(4)]
    faces = [square, arrow, arrow[:2], keyhole, line, arrow[1:] + arrow[:1]]
    points = np.array([corner for face in faces for corner in face], dtype=float)
    triangles, numbers = triangulate(points, np.array([len(face) for face in faces]))
    assert triangles[:2].tolist() == [[0, 1, 2], [0, 2, 3]]
    assert np.bincount(numbers, minlength=6).tolist() == [2, 2, 0, 8, 2, 2]
    areas = np.cross(*(points[triangles[:, i]] - points[triangles[:, 0]] for i in (1, 2)))[:, 2] / 2
    assert np.bincount(numbers, areas, 6).tolist() == [4, 1, 0, 12, 0, 1]
    assert (areas[numbers != 4] > 0).all()


def test_face_with_too_many_corners_is_refused() -> None:
    turns = np.linspace(0, 2 * np.pi, MOST_CORNERS + 2, endpoint=False)
    disc = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    gear = disc * np.where(np.arange(len(turns)) % 2, 1.0, 0.9)[:, None]
    triangles, _ = triangulate(disc, np.array([len(disc)]))
    assert len(triangles) == MOST_CORNERS
    with pytest.raises(AssetError, match=f"{len(gear)} corners"):
        triangulate(gear, np.array([len(gear)]))
