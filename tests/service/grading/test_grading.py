"""A whole run: a broken test costs only its own points, and the result adds up."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from tests.service.grading.assignments import (
    SCENE,
    Assignment,
    image_test,
    pixels,
    rays_test,
    scene,
    scene_test,
    time_test,
)

ENDLESS = scene(
    camera=SCENE["camera"] | {"width": 2048, "height": 2048},
    sampling={"antialiasing": {"pattern": "uniform", "samples": 4096}},
)
"""A scene that renders for hours."""

GREEDY = scene(camera=SCENE["camera"] | {"width": 8192, "height": 8192})
"""With target quality this needs gigabytes at once: float64 sums for every pixel."""


def test_broken_tests_never_cost_the_others(assignment: Assignment) -> None:
    assignment.hand_in("hits.npz", b"PK\x03\x04 cut off")
    assignment.hand_in("nan.npy", np.full((32, 48, 3), np.nan, np.float32))
    assignment.hand_in("picture.npy", pixels(SCENE))
    found = assignment.grade(
        rays_test(id="damaged"),
        image_test(id="nan", submitted={"file": "nan.npy", "encoding": "linear"}),
        image_test(id="lost", submitted={"file": "none.png", "encoding": "srgb"}),
        image_test(id="no-reference", reference={"type": "scene", "file": "none.json"}),
        image_test(id="good"),
    )
    statuses = [test.status for test in found.tests]
    assert statuses == ["not_gradable", "not_gradable", "skipped", "error", "passed"]
    assert (found.score, found.gradable, found.verdict) == (10, True, "mismatch")
    assert found.ungraded == ("damaged", "nan", "no-reference")


@pytest.mark.slow
def test_late_and_greedy_tests_never_cost_the_others(assignment: Assignment) -> None:
    assignment.hand_in("endless.json", ENDLESS)
    assignment.hand_in("greedy.json", GREEDY)
    target = {"mode": "target", "error": 0.01}
    found = assignment.grade(
        scene_test(id="late", submitted={"file": "endless.json"}, deadline=1.0),
        scene_test(id="greedy", submitted={"file": "greedy.json", "quality": target}, memory=256),
        scene_test(id="good"),
        members={"deadline": 60.0},
    )
    assert [test.status for test in found.tests] == ["error", "not_gradable", "passed"]
    assert "timed out after 1 s" in found.tests[0].message
    assert found.ungraded == ("late", "greedy")


def test_points_add_up_with_bonus_on_top(assignment: Assignment) -> None:
    assignment.hand_in("picture.npy", pixels(SCENE))
    tenths = [image_test(id=f"t{number}", points=0.1) for number in range(3)]
    found = assignment.grade(*tenths, scene_test(points=5, bonus=True))
    # The sum of these four doubles, rounded once.
    assert found.score == float(3 * Fraction(0.1) + 5)
    assert found.max_score == float(3 * Fraction(0.1))
    assert found.tests[3].bonus
    assert found.verdict == "match"


def test_reference_is_rendered_once_and_cached(assignment: Assignment, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    assignment.hand_in("picture.npy", pixels(SCENE))
    tests = image_test(), scene_test()
    assert assignment.grade(*tests, cache=cache).score == 20
    (kept,) = cache.iterdir()
    before = kept.stat().st_mtime_ns
    assert assignment.grade(*tests, cache=cache).score == 20
    assert kept.stat().st_mtime_ns == before
    # The name in the cache depends on the scene, not on its file name.
    (assignment.references / "scene.json").write_text(json.dumps(scene(lights=[])))
    assert assignment.grade(*tests, cache=cache).score == 0
    assert len(list(cache.iterdir())) == 2


@pytest.mark.parametrize(("budget", "points"), [({"full": 60}, 10), ({"full": 1e-9}, 0)])
def test_time_of_a_scene_is_compared_with_the_budget(
    assignment: Assignment, budget: dict[str, float], points: float
) -> None:
    assert assignment.test(time_test(accept=budget)).points == points


def test_time_earns_points_only_with_the_right_picture(assignment: Assignment) -> None:
    tests = scene_test(), time_test(accept={"full": 60})
    assert assignment.grade(*tests).score == 20
    assignment.hand_in("scene.json", scene(shapes=[], lights=[]))
    found = assignment.grade(*tests)
    assert [test.status for test in found.tests] == ["failed", "failed"]
    assert "only with all points in scene" in found.tests[1].message
    assert assignment.grade(scene_test(), time_test(accept={"full": 60}, requires=[])).score == 10


def test_required_test_that_cannot_be_graded_leaves_others_open(assignment: Assignment) -> None:
    assignment.hand_in("picture.npy", b"no picture")
    found = assignment.grade(
        image_test(), scene_test(requires=["picture"]), time_test(accept={"full": 60}, requires=["scene"])
    )
    assert [test.status for test in found.tests] == ["not_gradable", "error", "error"]
    assert found.score == 0


@pytest.mark.slow
def test_reference_that_times_out_costs_no_points(assignment: Assignment) -> None:
    (assignment.references / "endless.json").write_text(json.dumps(ENDLESS))
    assignment.hand_in("picture.npy", pixels(SCENE))
    late = image_test(id="late", reference={"type": "scene", "file": "endless.json"})
    found = assignment.grade(late, image_test(), members={"deadline": 10.0})
    assert [test.status for test in found.tests] == ["error", "passed"]
    assert "The reference was not rendered. It timed out after 10 s." in found.tests[0].message
    assert found.ungraded == ("late",)
