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
from renderer.scenes import LoadedScene

HOUR, OVER = Deadline.after(3600.0), Deadline.after(-1.0)
RAY = 1e-6


def enlarged(scene: LoadedScene, side: int) -> LoadedScene:
    camera = scene.document.camera.model_copy(update={"width": side, "height": side})
    return LoadedScene(scene.document.model_copy(update={"camera": camera}), scene.assets)


def finished(trial: Trial) -> Trial:
    while trial.more:
        trial.step()
    return trial


def predicted(trial: Trial) -> float:
    """Rays of the whole picture, as soon as there are probes."""
    while not trial.probed:
        trial.step()
    return float(trial.rays.total() + trial.outlook())


def test_rehearsal_renders_what_fits_the_time(ball_scene: LoadedScene) -> None:
    rehearsal = Rehearsal(ball_scene, 4 / 255, "single", RAY)
    rehearsal.run(OVER)
    assert not rehearsal.whole
    assert rehearsal.cpu_seconds() is None
    rehearsal = Rehearsal(ball_scene, 4 / 255, "single", RAY)
    rehearsal.run(HOUR)
    known = rehearsal.cpu_seconds()
    assert rehearsal.whole
    assert known is not None
    assert known.high < 1.2 * known.estimate


def test_trial_ends_within_a_pass_when_its_time_is_over(ball_scene: LoadedScene) -> None:
    trial = Trial(compile_scene(ball_scene, target(2 / 255, "single")), OVER, RAY)
    trial.step()
    first = trial.rays.copy()
    assert trial.more
    trial.step()
    assert trial.late
    assert not trial.more
    assert trial.rays == first


@pytest.mark.slow
def test_trial_and_its_part_predict_the_rays(ball_scene: LoadedScene) -> None:
    """The order of magnitude: what a few probes say is rough, and squares have borders of their own."""
    trial = Trial(compile_scene(enlarged(ball_scene, 160), target(0.25 / 255, "single")), HOUR, RAY)
    expected = predicted(trial)
    assert 0.25 < expected / finished(trial).rays.total() < 4.0
    assert trial.outlook() == 0
    plan = compile_scene(enlarged(ball_scene, 256), target(1 / 255, "single"))
    camera = mosaic(plan, 0.5)
    assert camera is not None
    trials = (Trial(plan, HOUR, RAY), Trial(seen_by(plan, camera), HOUR, RAY))
    whole, part = (predicted(each) / each.pixels for each in trials)
    assert 0.5 < part / whole < 2.0


def test_part_has_about_the_requested_share(ball_scene: LoadedScene) -> None:
    plan = compile_scene(enlarged(ball_scene, 8 * SIDE), target(1 / 255, "single"))
    for share, count in ((0.4, round(0.4 * 8 * 8)), (1e-9, FEWEST)):
        camera = mosaic(plan, share)
        assert camera is not None
        assert len(np.unique(camera.corners, axis=0)) == len(camera.corners) == count
    assert mosaic(compile_scene(ball_scene), 0.1) is None
    # Pixels of edges move with the squares; the ball is not narrow anywhere.
    camera = mosaic(plan, 0.4)
    assert camera is not None
    whole = replace(adaptive_part(plan), narrow=adaptive_part(plan).edges)
    moved = adaptive_part(seen_by(replace(plan, adaptive=whole), camera))
    assert moved.edges.size > 0
    for name in ("thin", "narrow", "edges", "shadow_edges"):
        np.testing.assert_array_equal(getattr(moved, name), camera.places(getattr(whole, name)))
