"""Arguments of compiling, rendering and tracing, and the errors of invalid ones."""

import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import renderer
import schemas
from schemas.api.jobs import JobRequest
from schemas.reading import read_document
from tests.documents import rectangle, scene
from tests.pictures import pictures

ROOM = pictures.of_room()
FLOOR = scene(rectangle([-1, 0, -1], [2, 0, 0], [0, 0, 2]))
RAYS = np.array([[0.25, 3.0, 0.25], [0.5, 3.0, 0.5], [9.0, 3.0, 0.0]])
DOWN = np.array([[0.0, -1.0, 0.0]] * 3)


@pytest.fixture(scope="module")
def plan() -> renderer.RenderPlan:
    return renderer.compile_scene(ROOM)


@pytest.mark.parametrize(
    "quality",
    [
        {"mode": "fixd"},
        {"mode": "fixed", "antialiasing": {"pattern": "uniform", "samples": 5}, "ligth": {}},
        {"mode": "target", "error": 0},
        "fixed",
        {"error": float("nan")},
    ],
    ids=str,
)
def test_quality_errors_are_those_of_a_request(quality: Any) -> None:
    with pytest.raises(renderer.SceneError) as over_http:
        read_document({"scene": FLOOR, "quality": quality}, JobRequest)
    for call in (renderer.compile_scene, lambda s, q: renderer.render(renderer.compile_scene(s), quality=q)):
        with pytest.raises(renderer.SceneError) as caught:
            call(FLOOR, quality)
        assert caught.value.errors == over_http.value.errors


def test_quality_may_be_a_dict(plan: renderer.RenderPlan) -> None:
    requested = {"antialiasing": {"pattern": "random", "samples": np.int64(2)}, "light": {"samples": 4}}
    checked = schemas.FixedQuality.model_validate(json.loads(json.dumps(requested, default=int)))
    image = renderer.render(plan, requested).image
    assert np.array_equal(image, renderer.render(plan, quality=checked).image)
    assert not np.array_equal(image, renderer.render(plan).image)


def test_scene_and_quality_problems_come_together() -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.compile_scene(FLOOR | {"ambient": [1, 1]}, {"mode": "fixd"})
    assert [problem.pointer for problem in caught.value.errors] == ["/ambient", "/quality/mode"]


@pytest.mark.parametrize(
    ("argument", "value", "error"),
    [
        *((name, value, ValueError) for name in ("workers", "tile_size") for value in (-1, 0)),
        ("tile_size", 10**9, ValueError),
        *((name, value, TypeError) for name in ("workers", "tile_size") for value in (1.5, True, "2")),
        ("on_tile", 3, TypeError),
    ],
    ids=str,
)
def test_argument_of_the_wrong_kind_is_named(
    plan: renderer.RenderPlan, argument: str, value: Any, error: type[Exception]
) -> None:
    with pytest.raises(error, match=f"^{argument} must be "):
        renderer.render(plan, **{argument: value})


def test_scene_in_place_of_a_plan_is_refused() -> None:
    with pytest.raises(TypeError, match="compile_scene"):
        renderer.render("room.json")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="compile_scene"):
        renderer.trace(ROOM, [[0, 0, 5]], [[0, 0, -1]])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"\['depth'\]"):
        renderer.compile_scene(FLOOR, layers="depth")


@pytest.mark.parametrize(
    "given",
    [
        lambda rows: rows.astype(np.float16),
        lambda rows: rows.tolist(),
        lambda rows: rows.astype(object),
        np.asfortranarray,
        lambda rows: np.repeat(np.repeat(rows, 2, axis=0), 2, axis=1)[::2, ::2],
        lambda rows: np.frombuffer(rows.tobytes()).reshape(rows.shape),
    ],
    ids=["float16", "lists", "objects", "columns first", "every other", "read-only"],
)
def test_rays_may_come_in_any_array_layout(plan: renderer.RenderPlan, given: Callable[[Any], Any]) -> None:
    found, expected = renderer.trace(plan, given(RAYS), given(DOWN)), renderer.trace(plan, RAYS, DOWN)
    assert np.array_equal(found.t, expected.t)
    assert np.array_equal(found.shape, expected.shape)


@pytest.mark.parametrize("none", [[], np.zeros((0, 3), np.float32)], ids=repr)
def test_trace_of_no_rays_is_empty(plan: renderer.RenderPlan, none: Any) -> None:
    hits = renderer.trace(plan, none, none)
    found = hits.t.shape, hits.position.shape, hits.visibility.shape
    assert found == ((0,), (0, 3), (0, len(ROOM["lights"])))


@pytest.mark.parametrize(
    "wrong",
    [RAYS.astype(str), RAYS > 0, RAYS.astype(complex), [[0, 0, 1], [2]], iter(RAYS), [["x", None, 0]], "rays",
     [[10**400, 0, 1]]],
    ids=["text", "truth", "complex", "ragged", "an iterator", "None", "a word", "too large"],
)  # fmt: skip
def test_rays_that_are_not_numbers_are_refused(plan: renderer.RenderPlan, wrong: Any) -> None:
    with pytest.raises(ValueError, match=r"^directions must be an array of real numbers"):
        renderer.trace(plan, RAYS[:1], wrong)


def test_comparison_does_not_load_the_renderer() -> None:
    """Graders compare in containers with half a processor."""
    probe = "import sys, accuracy.comparison; sys.exit('renderer.plan' in sys.modules)"
    subprocess.run([sys.executable, "-c", probe], check=True)
