"""A mistake that a program makes in all its pictures costs points once, and is named where it does."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from renderer import compile_scene, load_scene, render
from renderer.images.colors import linear_from_srgb
from service.grading.programs.displacements import DISPLACEMENTS, Displacement
from service.grading.programs.repairing import ambient_term
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels, scene

CAMERAS = {"front": [0, 2, 8], "left": [-5, 3, 6], "above": [3, 6, 5]}
"""Three tests of the same scene, seen from three sides."""

CHARGED = [
    {"mistakes": ["encoding", "orientation", "channels", "offset"], "tests": ["front"]},
    {"mistakes": ["exposure", "ambient"], "tests": ["left"]},
]


def seen(name: str, **changes: Any) -> dict[str, Any]:
    """The scene of a test."""
    camera = SCENE["camera"] | {"position": CAMERAS[name], "width": 64, "height": 48}
    grid = {"pattern": "uniform", "samples": 16}
    return scene(camera=camera, sampling={"antialiasing": grid}, **changes)


def image_tests(**changes: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        image_test(
            id=name,
            submitted={"file": f"{name}.npy", "encoding": "linear"},
            reference={"type": "scene", "file": f"{name}.json"},
            **changes.get(name, {}),
        )
        for name in CAMERAS
    ]


def hand_in(
    assignment: Assignment, after: Callable[[np.ndarray], np.ndarray] = np.asarray, **changes: Any
) -> None:
    """Hand in the pictures of a program, and write the scenes of all tests."""
    for name in CAMERAS:
        (assignment.references / f"{name}.json").write_text(json.dumps(seen(name)))
        assignment.hand_in(f"{name}.npy", after(np.clip(pixels(seen(name, **changes)), 0, 1)))


def graded(assignment: Assignment, *more: dict[str, Any], **changes: Any) -> dict[str, Any]:
    found = assignment.grade(*image_tests(**changes), *more, members={"charged_once": CHARGED}).tests
    return {each.id: each for each in found}


def points(found: dict[str, Any]) -> dict[str, float]:
    return {name: test.points for name, test in found.items()}


FRONT, LEFT = {"front": 0, "left": 10, "above": 10}, {"front": 10, "left": 0, "above": 10}


def test_two_mistakes_cost_points_where_both_are_named(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: linear_from_srgb(picture[::-1]))
    found = graded(assignment)
    assert points(found) == FRONT
    assert {cause.cause for cause in found["front"].diagnosis} == {"flipped_vertically", "gamma_missing"}
    assert all(cause.rmse_after < cause.rmse_before / 2 for cause in found["front"].diagnosis)
    for name in ("left", "above"):
        assert found[name].diagnosis == ()
        assert "as if gamma_missing and flipped_vertically were fixed" in found[name].message
        assert "costs points in front." in found[name].message


@pytest.mark.parametrize(
    ("changes", "after", "cause", "left"),
    [
        ({"ambient": [0, 0, 0]}, np.asarray, "ambient_missing", LEFT),
        ({}, lambda picture: np.clip(1.1 * picture, 0, 1), "exposure", LEFT),
        ({}, lambda picture: picture[:, :, ::-1], "channels_bgr", FRONT),
    ],
    ids=["ambient", "exposure", "channels"],
)
def test_mistake_costs_points_where_it_belongs(
    assignment: Assignment,
    changes: dict[str, Any],
    after: Callable[[np.ndarray], np.ndarray],
    cause: str,
    left: dict[str, float],
) -> None:
    hand_in(assignment, after, **changes)
    found = graded(assignment)
    assert points(found) == left
    named = [name for name, test in found.items() if any(each.cause == cause for each in test.diagnosis)]
    assert named == [name for name, kept in left.items() if not kept]


@pytest.mark.parametrize("offset", DISPLACEMENTS[1::5], ids=lambda offset: offset.cause)
def test_displaced_pixels_cost_points_once(assignment: Assignment, offset: Displacement) -> None:
    hand_in(assignment)
    for name in CAMERAS:
        assignment.hand_in(f"{name}.npy", displaced(name, offset))
    found = graded(assignment)
    assert points(found) == FRONT
    assert found["front"].diagnosis[0].cause == offset.cause


FINE = 8
"""Parts of a pixel along each side."""


@cache
def parts(name: str) -> np.ndarray:
    """The picture of a test with each pixel in 8 x 8 parts."""
    document = seen(name)
    size = {side: FINE * document["camera"][side] for side in ("width", "height")}
    one = {"antialiasing": {"pattern": "center", "samples": 1}}
    return np.clip(pixels(document | {"camera": document["camera"] | size, "sampling": one}), 0, 1)


def displaced(name: str, offset: Displacement) -> np.ndarray:
    """A picture whose pixels lie in the wrong place; its border continues as it is."""
    fine = parts(name)
    height, width = (side // FINE for side in fine.shape[:2])
    x, y = offset.places(*((np.arange(FINE * n) + 0.5) / FINE for n in (width, height)), width, height)
    columns, rows = (
        np.clip(np.floor(FINE * at).astype(int), 0, FINE * n - 1) for at, n in ((x, width), (y, height))
    )
    moved = fine[rows][:, columns]
    return moved.reshape(height, FINE, width, FINE, 3).mean(axis=(1, 3)).astype(np.float32)


def test_another_mistake_costs_points_too(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: picture[::-1])
    without_ball = np.clip(pixels(seen("above", shapes=SCENE["shapes"][:1])), 0, 1)
    assignment.hand_in("above.npy", without_ball[::-1])
    found = graded(assignment)
    assert points(found) == {"front": 0, "left": 10, "above": 0}
    assert found["above"].diagnosis[0].cause == "shape_missing"


def test_unreadable_files_hide_no_mistake(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: picture[::-1])
    (assignment.submission / "left.npy").unlink()
    found = graded(assignment)
    assert {name: (test.points, test.status) for name, test in found.items()} == {
        "front": (0, "failed"),
        "left": (0, "skipped"),
        "above": (10, "passed"),
    }
    for broken in (b"no picture", np.zeros((4, 5, 3), np.float32)):
        assignment.hand_in("left.npy", broken)
        found = graded(assignment)
        assert {name: test.status for name, test in found.items()} == {
            "front": "failed",
            "left": "not_gradable",
            "above": "passed",
        }


def test_mistake_in_a_single_picture_costs_points_there(assignment: Assignment) -> None:
    hand_in(assignment)
    assignment.hand_in("above.npy", np.clip(pixels(seen("above")), 0, 1)[::-1])
    found = graded(assignment)
    assert points(found) == {"front": 10, "left": 10, "above": 0}
    assert found["above"].diagnosis[0].cause == "flipped_vertically"


def test_forgiven_mistake_costs_nothing_at_all(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: picture[::-1])
    found = graded(assignment, front={"accept": {"by": "verdict", "forgiven": ["flipped_vertically"]}})
    assert points(found) == dict.fromkeys(CAMERAS, 10)
    assert "costs no points" in found["above"].message


def test_hidden_test_is_not_named_to_students(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: picture[::-1])
    found = graded(assignment, front={"hidden": True})
    assert points(found) == FRONT
    assert "front" not in found["above"].message


def test_metric_is_taken_without_the_mistake(assignment: Assignment) -> None:
    hand_in(assignment, lambda picture: picture[:, ::-1])
    accept = {"by": "metric", "metric": "rmse", "full": 0.001}
    assert points(graded(assignment, above={"accept": accept})) == FRONT


def test_ambient_term_is_what_ambient_light_adds() -> None:
    document = seen("front", lights=[])
    dark = document | {"ambient": [0, 0, 0]}
    term = ambient_term(load_scene(document), samples=1)
    assert term is not None
    one = {"sampling": {"antialiasing": {"pattern": "center", "samples": 1}}}
    lost = (render(compile_scene(load_scene(each | one))).image.astype(float) for each in (document, dark))
    with_, without = lost
    # Both are float32.
    np.testing.assert_allclose(term, with_ - without, atol=1e-6)
    assert ambient_term(load_scene(dark), samples=1) is None
