"""What target quality takes, from the first passes of the very picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.rehearsals import FEWEST, SIDE, Rehearsal, Trial, mosaic
from accuracy.quotes.settings import target
from renderer.compiling import compile_scene
from renderer.plan.plan import adaptive_part, seen_by
from renderer.rendering import render
from renderer.scenes import LoadedScene

HOUR = Deadline.after(3600.0)
OVER = Deadline.after(-1.0)
RAY = 1e-6


def enlarged(scene: LoadedScene, side: int) -> LoadedScene:
    camera = scene.document.camera.model_copy(update={"width": side, "height": side})
    return LoadedScene(scene.document.model_copy(update={"camera": camera}), scene.assets)


def test_a_picture_that_fits_the_time_is_rendered_whole(ball_scene: LoadedScene) -> None:
    rehearsal = Rehearsal(ball_scene, 4 / 255, "single", RAY)
    rehearsal.run(HOUR)
    known = rehearsal.cpu_seconds()
    assert rehearsal.whole
    assert known is not None
    assert known.high < 1.2 * known.estimate


def test_nothing_is_said_when_there_is_no_time(ball_scene: LoadedScene) -> None:
    rehearsal = Rehearsal(ball_scene, 4 / 255, "single", RAY)
    rehearsal.run(OVER)
    assert not rehearsal.whole
    assert rehearsal.cpu_seconds() is None


def test_the_passes_of_a_trial_are_those_of_the_picture(ball_scene: LoadedScene) -> None:
    quality = target(2 / 255, "single")
    plan = compile_scene(ball_scene, quality)
    trial = Trial(plan, HOUR, RAY)
    while trial.more:
        trial.step()
    assert trial.rays.total() == render(plan).report["rays"]["camera"]


def test_a_trial_ends_in_the_middle_of_a_pass_when_its_time_is_over(ball_scene: LoadedScene) -> None:
    trial = Trial(compile_scene(ball_scene, target(2 / 255, "single")), OVER, RAY)
    trial.step()
    first = trial.rays.copy()
    assert trial.more
    trial.step()
    assert trial.late
    assert not trial.more
    assert trial.rays == first


def test_what_is_to_follow_is_known_once_there_are_probes(ball_scene: LoadedScene) -> None:
    """The order of magnitude: what a few probes say of a small picture is rough."""
    plan = compile_scene(enlarged(ball_scene, 160), target(0.25 / 255, "single"))
    trial = Trial(plan, HOUR, RAY)
    while not trial.probed:
        trial.step()
    predicted = trial.rays.total() + trial.outlook()
    while trial.more:
        trial.step()
    assert 0.25 < predicted / trial.rays.total() < 4.0
    assert trial.outlook() == 0


def test_a_part_takes_as_many_rays_a_pixel_as_the_whole(ball_scene: LoadedScene) -> None:
    plan = compile_scene(enlarged(ball_scene, 256), target(1 / 255, "single"))
    camera = mosaic(plan, 0.5)
    assert camera is not None
    rays = []
    for trial in (Trial(plan, HOUR, RAY), Trial(seen_by(plan, camera), HOUR, RAY)):
        while not trial.probed:
            trial.step()
        rays.append((trial.rays.total() + trial.outlook()) / trial.pixels)
    # Squares have borders of their own, and the ball is in some of them and not in others.
    assert 0.5 < rays[1] / rays[0] < 2.0
    assert np.all(np.isfinite(rays))


@pytest.mark.parametrize(("share", "count"), [(0.4, round(0.4 * 8 * 8)), (1e-9, FEWEST)])
def test_a_part_has_about_the_requested_share_and_never_too_few_squares(
    ball_scene: LoadedScene, share: float, count: int
) -> None:
    camera = mosaic(compile_scene(enlarged(ball_scene, 8 * SIDE)), share)
    assert camera is not None
    assert len(np.unique(camera.corners, axis=0)) == len(camera.corners) == count


def test_a_picture_of_few_squares_has_no_part(ball_scene: LoadedScene) -> None:
    assert mosaic(compile_scene(ball_scene), 0.1) is None


def test_pixels_of_edges_move_with_the_squares_of_a_part(ball_scene: LoadedScene) -> None:
    plan = compile_scene(enlarged(ball_scene, 8 * SIDE), target(1 / 255, "single"))
    camera = mosaic(plan, 0.4)
    assert camera is not None
    # The ball is not narrow anywhere.
    whole = replace(adaptive_part(plan), narrow=adaptive_part(plan).edges)
    moved = adaptive_part(seen_by(replace(plan, adaptive=whole), camera))
    assert moved.edges.size > 0
    for name in ("thin", "narrow", "edges", "shadow_edges"):
        np.testing.assert_array_equal(getattr(moved, name), camera.places(getattr(whole, name)))
