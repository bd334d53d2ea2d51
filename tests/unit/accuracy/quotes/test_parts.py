"""Squares of a picture, one below the other, show what the picture shows there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from accuracy.quotes.parts import FEWEST, SIDE, Squares, part, squares
from accuracy.quotes.settings import target
from renderer.compiling import compile_scene
from renderer.plan.plan import RenderPlan, adaptive_part
from renderer.scenes import LoadedScene

SIZE = 8 * SIDE, 4 * SIDE


@pytest.fixture
def plan(ball_scene: LoadedScene) -> RenderPlan:
    camera = ball_scene.document.camera.model_copy(update={"width": SIZE[0], "height": SIZE[1]})
    scene = LoadedScene(ball_scene.document.model_copy(update={"camera": camera}), ball_scene.assets)
    return compile_scene(scene, target(1 / 255, "single"))


@pytest.fixture
def seen(plan: RenderPlan) -> Squares:
    found = squares(plan, 0.4)
    assert found is not None
    return found


def test_a_part_has_about_the_share_that_was_asked_for(seen: Squares) -> None:
    assert len(seen.corners) == round(0.4 * 8 * 4)
    assert len(np.unique(seen.corners, axis=0)) == len(seen.corners)


def test_there_are_never_so_few_squares_that_they_tell_nothing(plan: RenderPlan) -> None:
    found = squares(plan, 1e-9)
    assert found is not None
    assert len(found.corners) == FEWEST


def test_a_picture_of_few_squares_has_no_part(ball_scene: LoadedScene) -> None:
    assert squares(compile_scene(ball_scene), 0.1) is None


def test_rays_are_those_of_the_whole_picture(plan: RenderPlan, seen: Squares) -> None:
    y, x = (index.ravel() for index in np.indices((seen.height, SIDE)))
    number = y // SIDE
    columns, rows = x + seen.corners[number, 0], y % SIDE + seen.corners[number, 1]
    found = seen.rays(x + 0.25, y + 0.75, x, x)[1]
    np.testing.assert_array_equal(found, plan.camera.rays(columns + 0.25, rows + 0.75, x, x)[1])


def test_the_bounds_of_a_rectangle_hold_all_its_rays(plan: RenderPlan, seen: Squares) -> None:
    top, bottom = SIDE // 2, 2 * SIDE + 3
    left, right = seen.screen(np.array([3, 9]), np.array([bottom, top]))
    y, x = (index.ravel() for index in np.mgrid[top:bottom, 3:9])
    directions = seen.rays(x + 0.5, y + 0.5, x, x)[1]
    depth = (directions * plan.camera.forward).sum(axis=0)
    across = (directions * plan.camera.right).sum(axis=0) / depth
    along = (directions * plan.camera.up).sum(axis=0) / depth
    assert left[0] < across.min()
    assert across.max() < left[1]
    assert right[0] < along.min()
    assert along.max() < right[1]


def test_pixels_of_edges_move_with_their_squares(plan: RenderPlan, seen: Squares) -> None:
    whole = {tuple(pixel) for pixel in adaptive_part(plan).edges.T.tolist()}
    moved = adaptive_part(part(plan, seen)).edges.T.tolist()
    back = {
        (x + int(seen.corners[y // SIDE, 0]), y % SIDE + int(seen.corners[y // SIDE, 1])) for x, y in moved
    }
    inside = {
        (x, y)
        for x, y in whole
        if any(0 <= x - left < SIDE and 0 <= y - top < SIDE for left, top in seen.corners.tolist())
    }
    assert inside
    assert back == inside


def test_borders_are_the_outermost_pixels_of_every_square(seen: Squares) -> None:
    ring = np.ones((SIDE, SIDE), dtype=bool)
    ring[1:-1, 1:-1] = False
    np.testing.assert_array_equal(seen.borders(), np.tile(ring, (len(seen.corners), 1)))


def test_pixels_of_shadow_edges_move_with_their_squares_and_keep_the_shape_they_fall_on(
    plan: RenderPlan, seen: Squares
) -> None:
    columns, rows = np.arange(plan.width).repeat(plan.height), np.tile(np.arange(plan.height), plan.width)
    marked = np.stack((columns, rows, columns * plan.height + rows))
    every = replace(plan, adaptive=replace(adaptive_part(plan), shadow_edges=marked))
    moved = adaptive_part(part(every, seen)).shadow_edges
    assert moved.shape[1] == seen.width * seen.height
    x, y = np.divmod(moved[2], plan.height)
    assert (x % SIDE == moved[0] % SIDE).all()
    assert (y % SIDE == moved[1] % SIDE).all()
    assert np.unique(moved[0] * seen.height + moved[1]).size == moved.shape[1]
