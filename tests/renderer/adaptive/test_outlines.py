"""Outlines of triangles against those of solids whose geometry is known."""

from itertools import product

import numpy as np
import pytest

from renderer.accelerators.trees import FEW
from renderer.adaptive.outlines import SharedEdges, thin_places
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, unit
from tests.pictures import pictures
from tests.pictures.parts import plan_of

SIZE = 64


def pinhole() -> Pinhole:
    document = pictures.of_room()
    document["camera"] |= {"width": SIZE, "height": SIZE}
    return plan_of(document).camera


def cube(turned: np.random.Generator | None = None) -> Floats:
    """Triangles (3, 3, 12) of the cube from -1 to 1, half of them wound the other way round if asked."""
    found = []
    for axis, side in product(range(3), (-1.0, 1.0)):
        square = [np.insert(corner, axis, side) for corner in ([-1, -1], [1, -1], [1, 1], [-1, 1])]
        found += [[square[0], square[1], square[2]], [square[0], square[2], square[3]]]
    if turned:
        found = [three[::-1] if turned.random() < 0.5 else three for three in found]
    return np.ascontiguousarray(np.array(found).transpose(1, 2, 0))


@pytest.mark.parametrize("weight", [1.0, 0.0])
@pytest.mark.parametrize("seed", range(5))
def test_outline_of_a_cube(seed: int, weight: float) -> None:
    drawn = np.random.default_rng(seed)
    place = unit(drawn.uniform(0.3, 1, (3, 1))) * drawn.choice([-1, 1], (3, 1)) * 4
    outline = SharedEdges.of(np.zeros(12, np.int64), cube(drawn)).outline(place, weight)
    # A face is seen if the place is beyond it; an edge lies on the two faces of its fixed coordinates.
    limit = weight
    found = {frozenset(map(tuple, ends)) for ends in zip(outline.starts.T, outline.ends.T, strict=True)}
    expected = set()
    for axis in range(3):
        others = [other for other in range(3) if other != axis]
        for sides in product((-1.0, 1.0), repeat=2):
            seen = [side * place[other, 0] > limit for side, other in zip(sides, others, strict=True)]
            if seen[0] != seen[1]:
                ends = (np.insert(np.array(sides), axis, end) for end in (-1.0, 1.0))
                expected.add(frozenset(map(tuple, ends)))
    assert found == expected


def test_edges_of_one_or_three_triangles() -> None:
    fins = np.array([[[0, 0, 0], [0, 1, 0], fin] for fin in ([1, 0, 0], [0, 0, 1], [-1, 0, -1])], dtype=float)
    shared = SharedEdges.of(np.zeros(3, np.int64), np.ascontiguousarray(fins.transpose(1, 2, 0)))
    assert shared.outline(np.array([[3.0], [2.0], [5.0]])).numbers.size == 9


def strip(camera: Pinhole, width: float, length: float, parts: int) -> Floats:
    """Triangles of an upright strip at depth 4 around the middle of the picture; sizes in pixels."""
    pixel = 4 * 2 * camera.half_width / SIZE
    middle = camera.position + 4 * camera.forward
    rows = np.linspace(-length / 2, length / 2, parts + 1)
    left, right = (
        (middle + pixel * (side * camera.right * width / 2 + camera.up * rows)).T for side in (-1, 1)
    )
    three = [[left[:-1], right[:-1], right[1:]], [left[:-1], right[1:], left[1:]]]
    return np.ascontiguousarray(np.concatenate(three, axis=1).transpose(0, 2, 1))


@pytest.mark.parametrize("parts", [1, FEW])
@pytest.mark.parametrize("width", [0.1, 0.6])
def test_narrow_strip_is_thin(width: float, parts: int) -> None:
    camera = pinhole()
    vertices = strip(camera, width, 40, parts)
    outline = SharedEdges.of(np.zeros(vertices.shape[2], np.int64), vertices).outline(camera.position)
    columns, rows = thin_places(camera, outline, 1).pixels
    assert set(range(13, 51)) <= set(rows.tolist())
    assert set(columns.tolist()) <= {31, 32}


def test_wide_strip_is_not_thin() -> None:
    camera = pinhole()
    turns, heights = np.meshgrid(np.linspace(0, 2 * np.pi, 97), np.linspace(0, np.pi, 49))
    ball = np.stack((np.cos(turns) * np.sin(heights), np.cos(heights), np.sin(turns) * np.sin(heights)))
    ball = camera.position[:, :, None] + 4 * camera.forward[:, :, None] + 0.6 * ball
    a, b, c, d = ball[:, :-1, :-1], ball[:, 1:, :-1], ball[:, 1:, 1:], ball[:, :-1, 1:]
    triangles = np.stack([np.concatenate(pair, axis=1).reshape(3, -1) for pair in ((a, a), (b, c), (c, d))])
    for vertices in (triangles, strip(camera, 9, 40, 4)):
        outline = SharedEdges.of(np.zeros(vertices.shape[2], np.int64), vertices).outline(camera.position)
        assert outline.numbers.size > 8
        assert len(np.unique(thin_places(camera, outline, 1).pixels, axis=1).T) <= 4
