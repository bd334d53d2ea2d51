"""Flat shapes that overlap in one plane: which are found, and that the first of them is seen."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    triangle,
)
from accuracy.hard_cases.solids import triangles_of
from tests.images.parts import image_of, plan_of, png

FLOOR = rectangle([-2, 0.1, -2], [0, 0, 4], [4, 0, 0])
SIGN = triangle([-1, 0.1, -1], [-0.9, 0.1, 1.1], [1.3, 0.1, -0.7], material="other")
MATERIALS = {
    "plain": phong(),
    "other": phong([0.1, 0.9, 0.2], specular=0.4),
    "mirror": phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.9),
}


def rug(size: int) -> Json:
    """A mesh of 2 * size * size triangles in the floor's plane."""
    steps = np.linspace(-1, 1, size + 1)
    x, z = (part.ravel() for part in np.meshgrid(steps, steps))
    cells = np.array([i * (size + 1) + j for i in range(size) for j in range(size)])
    lower = np.stack((cells, cells + size + 2, cells + 1), axis=1)
    upper = np.stack((cells, cells + size + 1, cells + size + 2), axis=1)
    vertices = np.stack((x, np.full(x.size, 0.1), z), axis=1)
    return {**mesh(vertices, np.concatenate((lower, upper))), "material": "other"}


def room(*flat: Json) -> Json:
    """Flat shapes under a ball, before a mirror that shows them again."""
    return scene(
        *flat,
        sphere([0.4, 0.6, 0.5], 0.4),
        rectangle([-2, 0, -2], [4, 0, 0], [0, 3, 0], material="mirror"),
        materials=MATERIALS,
        lights=[lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2], visible=False), bulb([1, 2, 1.5])],
        sampling=sampled(4, 9, light="sobol"),
    )


def names(document: Json) -> list[str]:
    return [entry.name for entry in plan_of(document).entries]


@pytest.mark.parametrize("culling", [True, False])
@pytest.mark.parametrize("later", [[SIGN], [rug(3)], [rug(6)], [SIGN, rug(6)]])
def test_what_lies_in_an_earlier_shape_changes_no_pixel(later: list[Json], culling: bool) -> None:
    """Neither where it is seen, nor in the mirror, nor by its shadow."""
    assert "shapes in one plane" in names(room(FLOOR, *later))
    with_it, without = (image_of(room(FLOOR, *more), culling=culling) for more in (later, []))
    np.testing.assert_array_equal(with_it, without)


@pytest.mark.parametrize("earlier", [SIGN, rug(3), rug(6)])
def test_what_comes_first_is_seen_whole(earlier: Json) -> None:
    """From above, wherever it is hit over a floor far below."""
    below = rectangle([-2, -30, -2], [0, 0, 4], [4, 0, 0])
    both, alone = (plan_of(room(earlier, other)) for other in (FLOOR, below))
    first, expected = (hit_shapes(plan) for plan in (both, alone))
    assert (expected == 0).sum() > 20
    assert (first[expected == 0] == 0).all()


def hit_shapes(plan: Any) -> Any:
    """Numbers of the shapes that rays hit straight from above."""
    x, z = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 400))
    origins = np.stack((x, np.full(400, 0.15), z), axis=1)
    return renderer.trace(plan, origins, np.tile([0.0, -1, 0], (400, 1))).shape


def test_shapes_that_share_an_edge_or_stand_on_another_do_not_overlap() -> None:
    """Tiles and triangles turned by an angle that no double is exact at, far from the origin."""
    across, up = np.array([np.cos(0.3), 0, np.sin(0.3)]), np.array([0.0, 1, 0])
    along, corner = np.cross(across, up), np.array([1e5, 3.0, -7e4])
    places = [(corner + i * across + j * along) for i in range(4) for j in range(4)]
    tiles = [rectangle(place.tolist(), across.tolist(), along.tolist()) for place in places]
    vertices = np.array([place + 8 * across for place in places])
    cells = [4 * i + j for i in range(3) for j in range(3)]
    faces = np.array([(c, c + 4, c + 5) for c in cells] + [(c, c + 5, c + 1) for c in cells])
    wall = rectangle(corner.tolist(), across.tolist(), up.tolist())
    assert "shapes in one plane" not in names(scene(*tiles, *triangles_of(vertices, faces), wall))


def test_shapes_in_parallel_planes_do_not_overlap() -> None:
    above = rectangle([-2, 0.1 + 1e-12, -2], [0, 0, 4], [4, 0, 0])
    assert "shapes in one plane" not in names(scene(FLOOR, above))


def test_a_large_mesh_stands_beside_a_few_displaced_triangles() -> None:
    """Two families of one kind: the one that is tested one by one is found among the flat ones."""
    small = rectangle([1, 0.5, 1], [0, 0, 0.01], [0.01, 0, 0], material="relief")
    relief = phong([0.5, 0.5, 0.5], displacement_map="heights", displacement_height=0.001)
    document = {
        **scene(rug(6), small, materials={**MATERIALS, "relief": relief}),
        "textures": {"heights": {"type": "image", "asset": "heights.png", "encoding": "linear"}},
    }
    plan = plan_of(document, files={"heights.png": png(np.full((2, 2, 3), 128, dtype=np.uint8))})
    below, above = np.array([[1.005, 2, 1.005]]), np.array([[0.2, 2, 0.1]])
    hits = renderer.trace(plan, np.concatenate((below, above)), np.tile([0.0, -1, 0], (2, 1)))
    assert hits.shape.tolist() == [1, 0]
