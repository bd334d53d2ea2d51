"""A mistake that a program makes in all its pictures costs points once, and is named where it does."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from renderer import compile_scene, load_scene, render
from renderer.images.colors import linear_from_srgb
from schemas.grading.grades import Grade
from service.grading.repairing import ambient_term
from tests.service.grading.assignments import SCENE, Assignment, codes_of, image_test, npy, pixels, png, scene

CAMERAS = {"front": [0, 2, 8], "left": [-5, 3, 6], "above": [3, 6, 5]}
"""Three tests of the same scene, seen from three sides."""

CHARGED = [
    {"mistakes": ["encoding", "orientation", "channels", "offset"], "tests": ["front"]},
    {"mistakes": ["exposure", "ambient"], "tests": ["left"]},
]
ALL, FRONT = dict.fromkeys(CAMERAS, 10), {"front": 0, "left": 10, "above": 10}
NOTHING = dict.fromkeys(CAMERAS, 0)
LEFT, ABOVE = {"front": 10, "left": 0, "above": 10}, {"front": 10, "left": 10, "above": 0}

SLOW = pytest.mark.slow

Program = Callable[[str], np.ndarray]
"""A program draws the picture of a test."""


def seen(name: str, **changes: Any) -> dict[str, Any]:
    """The scene of a test."""
    camera = SCENE["camera"] | {"position": CAMERAS[name], "width": 64, "height": 48}
    grid = {"pattern": "uniform", "samples": 16}
    return scene(camera=camera, sampling={"antialiasing": grid}, **changes)


def drawn(name: str, **changes: Any) -> np.ndarray:
    return np.clip(pixels(seen(name, **changes)), 0, 1)


right = cache(drawn)


def graded(assignment: Assignment, program: Program, **changes: dict[str, Any]) -> dict[str, Any]:
    """The tests of a program's pictures, by name; bytes or None in place of a picture are handed in too."""
    tests = []
    for name in CAMERAS:
        (assignment.references / f"{name}.json").write_text(json.dumps(seen(name)))
        assignment.hand_in(f"{name}.npy", program(name))
        files = {
            "submitted": {"file": f"{name}.npy", "encoding": "linear"},
            "reference": {"type": "scene", "file": f"{name}.json"},
        }
        tests.append(image_test(id=name, **files, **changes.get(name, {})))
    found = assignment.grade(*tests, members={"charged_once": CHARGED}).tests
    return {each.id: each for each in found}


def points(found: dict[str, Any]) -> dict[str, float]:
    return {name: test.points for name, test in found.items()}


def turned(name: str) -> np.ndarray:
    return right(name)[::-1]


def turned_without_a_ball_above(name: str) -> np.ndarray:
    return turned(name) if name != "above" else drawn(name, shapes=SCENE["shapes"][:1])[::-1]


def test_two_mistakes_cost_points_where_both_are_named(assignment: Assignment) -> None:
    found = graded(assignment, lambda name: linear_from_srgb(turned(name)))
    assert points(found) == FRONT
    assert {cause.cause for cause in found["front"].diagnosis} == {"flipped_vertically", "gamma_missing"}
    assert all(cause.rmse_after < cause.rmse_before / 2 for cause in found["front"].diagnosis)
    for name in ("left", "above"):
        assert found[name].diagnosis == ()
        assert "as if gamma_missing and flipped_vertically were fixed" in found[name].message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "cause", "left"),
    [
        (lambda name: drawn(name, ambient=[0, 0, 0]), "ambient_missing", LEFT),
        (lambda name: np.clip(1.1 * right(name), 0, 1), "exposure", LEFT),
        (lambda name: right(name)[:, :, ::-1], "channels_bgr", FRONT),
        (lambda name: turned(name) if name == "above" else right(name), "flipped_vertically", ABOVE),
    ],
    ids=["ambient", "exposure", "channels", "one picture"],
)
def test_mistake_costs_points_where_it_belongs(
    assignment: Assignment, program: Program, cause: str, left: dict[str, float]
) -> None:
    found = graded(assignment, program)
    assert points(found) == left
    named = [name for name, test in found.items() if any(each.cause == cause for each in test.diagnosis)]
    assert named == [name for name, kept in left.items() if not kept]


@pytest.mark.slow
def test_another_mistake_costs_points_too(assignment: Assignment) -> None:
    found = graded(assignment, turned_without_a_ball_above)
    assert points(found) == {"front": 0, "left": 10, "above": 0}
    assert found["above"].diagnosis[0].cause == "shape_missing"


@pytest.mark.parametrize("broken", [b"no picture", np.zeros((4, 5, 3), np.float32)], ids=["bytes", "size"])
def test_unusable_file_hides_no_mistake(assignment: Assignment, broken: Any) -> None:
    found = graded(assignment, lambda name: broken if name == "left" else turned(name))
    assert points(found) == {"front": 0, "left": 0, "above": 10}
    assert found["left"].status == "not_gradable"


@pytest.mark.parametrize(
    ("changes", "left"),
    [
        ({"front": {"accept": {"by": "verdict", "forgiven": ["flipped_vertically"]}}}, ALL),
        ({"front": {"hidden": True}}, FRONT),
        ({"above": {"accept": {"by": "metric", "metric": "rmse", "full": 0.001}}}, FRONT),
    ],
    ids=["forgiven", "hidden", "metric"],
)
def test_tests_decide_what_a_mistake_costs(
    assignment: Assignment, changes: dict[str, Any], left: dict[str, float]
) -> None:
    found = graded(assignment, turned, **changes)
    assert points(found) == left
    # Students do not read the names of hidden tests.
    assert ("front" in found["above"].message) == ("above" in changes)


def without_light(name: str) -> np.ndarray:
    return drawn(name, lights=[])


def by_pictures(assignment: Assignment, program: Program, tolerance: float = 0.01, **members: Any) -> Grade:
    """A grade by reference pictures: no scene tells what causes a difference."""
    accept = {"by": "verdict", "tolerance": tolerance}
    tests = []
    for name in CAMERAS:
        (assignment.references / f"{name}.npy").write_bytes(npy(right(name)))
        assignment.hand_in(f"{name}.png", png(codes_of(program(name))))
        files = {
            "submitted": {"file": f"{name}.png", "encoding": "srgb"},
            "reference": {"type": "picture", "file": f"{name}.npy", "encoding": "linear"},
        }
        tests.append(image_test(id=name, **files, accept=accept, deadline=60.0))
    return assignment.grade(*tests, members={"charged_once": CHARGED} | members)


def earned(assignment: Assignment, program: Program) -> dict[str, float]:
    return {test.id: test.points for test in by_pictures(assignment, program).tests}


def exposed(program: Program, scale: float) -> Program:
    """The same pictures, so many times too bright."""
    return lambda name: scale * program(name)


@pytest.mark.parametrize("color", [0.0, pytest.param(0.0003, marks=SLOW), 0.2, pytest.param(1.0, marks=SLOW)])
def test_one_color_earns_nothing(assignment: Assignment, color: float) -> None:
    assert earned(assignment, lambda name: np.full_like(right(name), color)) == NOTHING


@pytest.mark.parametrize("scale", [pytest.param(0.002, marks=SLOW), 0.1, 10, pytest.param(30, marks=SLOW)])
@pytest.mark.parametrize("program", [right, without_light])
def test_exposure_beyond_repair_costs_all_points(
    assignment: Assignment, program: Program, scale: float
) -> None:
    assert earned(assignment, exposed(program, scale)) == NOTHING


@pytest.mark.parametrize("scale", [0.3, pytest.param(1.3, marks=SLOW)])
def test_exposure_hides_no_other_mistake(assignment: Assignment, scale: float) -> None:
    assert earned(assignment, exposed(right, scale)) == LEFT
    assert earned(assignment, exposed(without_light, scale)) == NOTHING


def test_white_is_no_evidence(assignment: Assignment) -> None:
    # Most of what is in front is white at twice the brightness: a right picture cannot be told from a wrong.
    assert earned(assignment, exposed(right, 2)) == {"front": 0, "left": 0, "above": 10}


def test_codes_too_coarse_for_the_tolerance_are_no_evidence(assignment: Assignment) -> None:
    found = by_pictures(assignment, exposed(right, 0.3), tolerance=0.001)
    assert [test.points for test in found.tests] == [0, 0, 0]
    assert "too little of the picture is left" in found.tests[2].message


def test_late_search_leaves_pictures_open(assignment: Assignment) -> None:
    found = by_pictures(assignment, turned, deadline=0.001)
    assert [test.status for test in found.tests] == ["error"] * len(CAMERAS)
    assert found.ungraded == tuple(CAMERAS)
    assert not found.gradable


def test_ambient_term_is_what_ambient_light_adds() -> None:
    document = seen("front", lights=[])
    dark = document | {"ambient": [0, 0, 0]}
    term = ambient_term(load_scene(document), samples=1)
    assert term is not None
    one = {"sampling": {"antialiasing": {"pattern": "center", "samples": 1}}}
    with_, without = (render(compile_scene(load_scene(each | one))).image for each in (document, dark))
    np.testing.assert_allclose(term, with_.astype(float) - without, atol=1e-6)
    assert ambient_term(load_scene(dark), samples=1) is None
