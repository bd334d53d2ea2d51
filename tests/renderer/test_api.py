"""What `compile_scene`, `render` and `trace` are given, and what they say of it where it cannot be used."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
import schemas
from accuracy.hard_cases.documents import rectangle, scene
from accuracy.inspection import inspection_plan
from accuracy.quotes import quote
from schemas.api.jobs import JobRequest
from schemas.reading import read_document
from tests.pictures import pictures

ROOM = pictures.of_room()
FLOOR = scene(rectangle([-1, 0, -1], [2, 0, 0], [0, 0, 2]))


@pytest.fixture(scope="module")
def plan() -> renderer.RenderPlan:
    return renderer.compile_scene(ROOM)


WRONG: dict[str, Any] = {
    "a misspelt mode": {"mode": "fixd"},
    "two mistakes": {"mode": "fixed", "antialiasing": {"pattern": "uniform", "samples": 5}, "ligth": {}},
    "an error that is none": {"mode": "target", "error": 0},
    "too many samples": {"antialiasing": {"pattern": "random", "samples": 5000}},
    "a word": "fixed",
    "a number that is not finite": {"error": float("nan")},
}
GIVEN_TO: dict[str, Callable[[Any], Any]] = {
    "compile_scene": lambda quality: renderer.compile_scene(FLOOR, quality),
    "render": lambda quality: renderer.render(renderer.compile_scene(FLOOR), quality=quality),
}


@pytest.mark.parametrize("quality", WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("given_to", GIVEN_TO)
def test_wrong_quality(given_to: str, quality: Any) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        GIVEN_TO[given_to](quality)
    with pytest.raises(renderer.SceneError) as over_http:
        read_document({"scene": FLOOR, "quality": quality}, JobRequest)
    assert caught.value.errors == over_http.value.errors


def test_quality_as_a_dict(plan: renderer.RenderPlan) -> None:
    requested = {"antialiasing": {"pattern": "random", "samples": np.int64(2)}, "light": {"samples": 4}}
    checked = schemas.FixedQuality.model_validate(json.loads(json.dumps(requested, default=int)))
    image = renderer.render(plan, requested).image
    assert np.array_equal(image, renderer.render(plan, quality=checked).image)
    assert not np.array_equal(image, renderer.render(plan).image)


def test_qualities_of_inspections_and_quotes() -> None:
    assert inspection_plan(FLOOR, {"precision": "double"}).dtype == np.float64
    offered = quote(renderer.load_scene(FLOOR), {"light": {"samples": 9}}, limit=0.0)
    assert offered.price.cpu_seconds > 0


@pytest.mark.parametrize(
    ("argument", "value", "error"),
    [
        *((name, value, ValueError) for name in ("workers", "tile_size") for value in (-1, 0)),
        ("tile_size", 10**9, ValueError),
        *((name, value, TypeError) for name in ("workers", "tile_size") for value in (1.5, True, "2", [2])),
        ("on_tile", 3, TypeError),
        ("on_tile", "print", TypeError),
    ],
    ids=str,
)
def test_invalid_argument_is_named(
    plan: renderer.RenderPlan, argument: str, value: Any, error: type[Exception]
) -> None:
    with pytest.raises(error, match=f"^{argument} must be .*, not ") as caught:
        renderer.render(plan, **{argument: value})
    assert type(value).__name__ in str(caught.value) or repr(value) in str(caught.value)


@pytest.mark.parametrize(
    "call",
    [lambda: renderer.render("room.json"), lambda: renderer.trace(ROOM, [[0, 0, 5]], [[0, 0, -1]])],  # type: ignore[arg-type]
    ids=["render", "trace"],
)
def test_scene_in_place_of_a_plan(call: Callable[[], Any]) -> None:
    with pytest.raises(TypeError, match="compile_scene"):
        call()


@pytest.mark.parametrize("source", [None, 5, ["scene.json"], 1j], ids=repr)
def test_value_that_is_no_scene(source: Any) -> None:
    with pytest.raises(TypeError, match=f"not {type(source).__name__}"):
        renderer.load_scene(source)


def test_folder_may_be_a_path(tmp_path: Path) -> None:
    texture = {"type": "image", "asset": "board.png"}
    document = FLOOR | {
        "textures": {"board": texture},
        "materials": {"plain": {"type": "phong", "color_texture": "board", "ambient": 1}},
        "ambient": [1, 1, 1],
    }
    (tmp_path / "board.png").write_bytes(_pixel())
    for folder in (tmp_path, str(tmp_path)):
        renderer.compile_scene(renderer.load_scene(document, assets=folder))
    with pytest.raises(NotADirectoryError, match="no folder of a scene's files"):
        renderer.load_scene(document, assets=tmp_path / "board.png")
    with pytest.raises(TypeError, match="dict has none"):
        renderer.load_scene(document, assets={"board.png": b""})  # type: ignore[arg-type]


def _pixel() -> bytes:
    from renderer.images.files import encode_png
    from schemas.scene import Display

    return encode_png(np.ones((1, 1, 3)), Display())


def test_loaded_scene_with_other_files(tmp_path: Path) -> None:
    loaded = renderer.load_scene(FLOOR)
    assert renderer.load_scene(loaded) is loaded
    (tmp_path / "a").write_bytes(b"one")
    assert renderer.load_scene(loaded, assets=tmp_path).assets.read("a") == b"one"
    with pytest.raises(NotADirectoryError):
        renderer.load_scene(loaded, assets=tmp_path / "a")
    for limits in (5, {"max_pixels": 3}):
        with pytest.raises(TypeError, match=f"not {type(limits).__name__}"):
            renderer.load_scene(FLOOR, limits=limits)  # type: ignore[arg-type]


RAYS = np.array([[0.25, 3.0, 0.25], [0.5, 3.0, 0.5], [9.0, 3.0, 0.0]])
DOWN = np.array([[0.0, -1.0, 0.0]] * 3)


@pytest.mark.parametrize(
    "given",
    [
        lambda rows: rows.astype(np.float32),
        lambda rows: rows.astype(np.float16),
        lambda rows: rows.tolist(),
        lambda rows: rows.astype(object),
        np.asfortranarray,
        lambda rows: np.repeat(np.repeat(rows, 2, axis=0), 2, axis=1)[::2, ::2],
        lambda rows: np.frombuffer(rows.tobytes()).reshape(rows.shape),
    ],
    ids=["float32", "float16", "lists", "objects", "columns first", "every other", "read-only"],
)
def test_rays_in_any_memory_order(plan: renderer.RenderPlan, given: Callable[[Any], Any]) -> None:
    found, expected = renderer.trace(plan, given(RAYS), given(DOWN)), renderer.trace(plan, RAYS, DOWN)
    assert np.array_equal(found.t, expected.t)
    assert np.array_equal(found.shape, expected.shape)


@pytest.mark.parametrize(
    "wrong",
    [
        RAYS.astype(str),
        RAYS > 0,
        RAYS.astype(complex),
        [[0, 0, 1], [2]],
        iter(RAYS),
        [["x", None, 0]],
        "rays",
        [[10**400, 0, 1]],
    ],
    ids=["text", "truth", "complex", "ragged", "an iterator", "None", "a word", "too large"],
)
def test_rays_that_are_no_numbers(plan: renderer.RenderPlan, wrong: Any) -> None:
    with pytest.raises(ValueError, match=r"^directions must be an array of real numbers"):
        renderer.trace(plan, RAYS[:1], wrong)
