"""Pixels along edges of hard shadows, against shadows that rays find."""

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    scene,
    sphere,
    sun,
    triangle,
)
from renderer.adaptive.neighbours import spread
from renderer.plan.plan import adaptive_part
from schemas.quality import FixedQuality, TargetQuality

SIZE = 48
TARGET = TargetQuality(mode="target", error=0.004)
FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
BOARD = rectangle([-1, 1, -1], [1.4, 0.2, 0.3], [0.1, 0.1, 1.7])
SAIL = triangle([-1.5, 0.7, -1], [1.2, 0.5, 0.1], [0.2, 1.4, 1])
WIRE = ellipsoid([0, 0.6, 0], [1.4, 0, 0.4], [0, 0.0075, 0], [-0.002, 0, 0.007])
BULB, SUN = bulb([1, 5, 2]), sun([-0.4, -1, 0.2])


def small(*shapes: Json, lights: list[Json], **changes: object) -> Json:
    above = camera(position=[0, 6, 3], look_at=[0, 0, 0], vertical_fov=40, width=SIZE, height=SIZE)
    matt = {"plain": phong([1, 1, 1], ambient=0, diffuse=1)}
    return scene(*shapes, lights=lights, camera=above | changes, materials=matt)


def marked(document: Json) -> np.ndarray:
    """Pixels (H, W) where the floor, which is the last shape, may show the edge of a shadow."""
    plan = renderer.compile_scene(renderer.load_scene(document), TARGET)
    columns, rows, shapes = adaptive_part(plan).shadow_edges
    found = np.zeros((SIZE, SIZE), dtype=bool)
    on_floor = shapes == len(document["shapes"]) - 1
    found[rows[on_floor], columns[on_floor]] = True
    return found


def partly_shadowed(document: Json) -> np.ndarray:
    """Pixels (H, W) of the floor in which some samples are lit and others are not."""
    found = np.zeros((2, SIZE, SIZE), dtype=bool)
    plan = renderer.compile_scene(renderer.load_scene(document), None)
    for place in np.random.default_rng(5).random((40, 2)):
        y, x = np.indices((SIZE, SIZE)).reshape(2, -1) + place[::-1, None]
        origins, directions = np.broadcast_to(plan.camera.position, (3, x.size)), plan.camera.directions(x, y)
        hits = renderer.trace(plan, origins.T, directions.T)
        on_floor = hits.shape == len(document["shapes"]) - 1
        lit = hits.visibility[:, 0] > 0
        found[0] |= (on_floor & lit).reshape(SIZE, SIZE)
        found[1] |= (on_floor & ~lit).reshape(SIZE, SIZE)
    return found.all(axis=0)


@pytest.mark.parametrize("light", [BULB, SUN], ids=["bulb", "sun"])
@pytest.mark.parametrize("shape", [BOARD, SAIL, WIRE], ids=["board", "sail", "wire"])
def test_hard_shadow_edges_are_marked(shape: Json, light: Json) -> None:
    document = small(shape, FLOOR, lights=[light])
    ends = partly_shadowed(document)
    assert ends.sum() > 10
    found = marked(document)
    assert not (ends & ~spread(found, 1)).any()
    # An edge may cross a corner of a pixel between two places along it; a wire's shadow has a width.
    assert (ends & ~found).sum() <= ends.sum() / 3


def test_pixels_far_from_shadows() -> None:
    document = small(BOARD, FLOOR, lights=[BULB])
    plan = renderer.compile_scene(renderer.load_scene(document), None)
    y, x = np.indices((SIZE, SIZE)).reshape(2, -1) + 0.5
    origins = np.broadcast_to(plan.camera.position, (3, x.size))
    floor = (renderer.trace(plan, origins.T, plan.camera.directions(x, y).T).shape == 1).reshape(SIZE, SIZE)
    away = floor & ~spread(partly_shadowed(document), 2)
    assert away.any()
    assert not (marked(document) & away).any()


def test_wide_penumbra_of_a_thin_shape() -> None:
    wide = lamp([-1, 5, 1], [2, 0, 0], [0, 0, 2])
    assert not marked(small(BOARD, FLOOR, lights=[wide])).any()
    assert marked(small(WIRE, FLOOR, lights=[wide])).any()


def test_penumbra_is_as_wide_as_the_lamp() -> None:
    board = rectangle([-1, 1, -0.9], [2, 0, 0], [0, 0, 1.8])
    across, along = ([-1, 5, -0.01], [2, 0, 0], [0, 0, 0.02]), ([-0.01, 5, -1], [0.02, 0, 0], [0, 0, 2])
    by_row, by_column = (marked(small(board, FLOOR, lights=[lamp(*edges)])) for edges in (across, along))
    hard = marked(small(board, FLOOR, lights=[bulb([0, 5, 0])]))
    # The lamp that is long from left to right casts sharp edges from left to right, and no others.
    assert by_row.any(axis=0).sum() > 15
    assert by_row.any(axis=1).sum() <= 4
    assert by_column.any(axis=1).sum() > 15
    assert (by_row & by_column).sum() <= 4
    assert not (hard & ~(by_row | by_column)).any()


def test_mesh_casts_shadows_by_its_outline() -> None:
    vertices = np.array(SAIL["vertices"])
    tiny = 90 + np.arange(40)[:, None, None] + np.array([[0, 50, -200], [1, 50, -200], [0, 51, -200]])
    places = np.vstack([vertices, vertices.mean(axis=0), *tiny])
    faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], *(4 + np.arange(120).reshape(40, 3)).tolist()]
    in_tree = marked(small(mesh(places, np.array(faces)), FLOOR, lights=[BULB]))
    np.testing.assert_array_equal(in_tree, marked(small(SAIL, FLOOR, lights=[BULB])))


def test_shadows_end_with_the_floor() -> None:
    narrow = rectangle([-0.2, 0, -0.2], [0, 0, 0.4], [0.4, 0, 0])
    assert (
        marked(small(BOARD, FLOOR, lights=[BULB])).sum() > marked(small(BOARD, narrow, lights=[BULB])).sum()
    )
    assert not marked(small(BOARD, FLOOR, lights=[bulb([0, 0.5, 0])])).any()


def test_pictures_without_shadow_edges() -> None:
    document = small(BOARD, FLOOR, lights=[BULB])
    assert renderer.compile_scene(renderer.load_scene(document), FixedQuality(mode="fixed")).adaptive is None
    lens = small(BOARD, FLOOR, lights=[BULB], lens_radius=0.1)
    assert adaptive_part(renderer.compile_scene(renderer.load_scene(lens), TARGET)).shadow_edges.size == 0
    balls = small(sphere([0, 2, 0], 0.5), sphere([0, -5, 0], 5), lights=[BULB])
    assert adaptive_part(renderer.compile_scene(renderer.load_scene(balls), TARGET)).shadow_edges.size == 0
