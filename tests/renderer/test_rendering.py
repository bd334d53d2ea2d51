"""A whole picture: its report, and how a failure is reported."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import phong, rectangle, sampled, scene, triangle
from renderer import rendering
from renderer.interaction import Rays
from tests.pictures import pictures
from tests.pictures.parts import SINGLE, image_of, plan_of

SMALL = pictures.of_room()


def test_report() -> None:
    result = renderer.render(plan_of(SMALL))
    report = result.report
    assert (report["width"], report["height"]) == (24, 16)
    assert report["rays"]["camera"] == 24 * 16 * 4
    assert 0 < report["rays"]["shadow"] <= 24 * 16 * 4 * 9
    assert report["seconds"] >= 0
    assert report["cpu_seconds"] >= 0
    assert report["error"] is None
    assert report["numerics"] == {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 0}
    assert report["plan"] == plan_of(SMALL).describe().model_dump(mode="json")
    assert (result.image.dtype, result.image.shape) == (np.float32, (16, 24, 3))


def test_triangles_without_area_are_counted() -> None:
    lines = [triangle([0, 0, 0], [1, 1, 1], [2, 2, 2]), triangle([1, 2, 3], [1, 2, 3], [4, 5, 6])]
    result = renderer.render(plan_of(scene(*lines, rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]))))
    numerics = result.report["numerics"]
    assert (numerics["degenerate_dropped"], numerics["retried"]) == (2, 2)


@pytest.mark.parametrize("height", [1e-13, 1e-300])
@pytest.mark.parametrize("kind", ["triangle", "mesh"])
def test_exact_triangles_are_counted(kind: str, height: float) -> None:
    thin, plain = [[0, 0, 0], [1, 0, 0], [0.5, height, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    if kind == "mesh":
        mesh = {"type": "mesh", "vertices": thin + plain[2:], "triangles": [[0, 1, 2], [0, 1, 3]]}
        shapes = [mesh | {"material": "plain"}]
    else:
        shapes = [triangle(*thin), triangle(*plain)]
    numerics = renderer.render(plan_of(scene(*shapes))).report["numerics"]
    assert numerics == {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 1}


def test_bad_pixels_are_counted() -> None:
    """An edge through the picture: the mean of a bright pass and black ones is within float32 again."""
    edge, settings = (
        rectangle([-9, -9, 0], [9, 0, 0], [2, 18, 0]),
        {"sampling": sampled(16), "background": [0] * 3},
    )
    bright = {"plain": phong([1e30] * 3, ambient=1e30)}
    plain = image_of(scene(edge, **settings))
    result = renderer.render(plan_of(scene(edge, ambient=[1e30] * 3, materials=bright, **settings)))
    shown = (plain > 0).any(axis=2)
    assert (result.image[shown] < np.finfo(np.float32).max).any()
    assert result.report["numerics"]["clamped"] == np.count_nonzero(shown)


def test_quality_of_render() -> None:
    plan = plan_of(SMALL)
    again = plan_of(SMALL, SINGLE.model_copy(update={"precision": "double"}))
    changed = renderer.render(plan, again.quality).image
    assert changed.tobytes() == renderer.render(again).image.tobytes()
    assert changed.tobytes() != renderer.render(plan).image.tobytes()


class Broken:
    """A stage that fails as arithmetic or memory may."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def run(self, rays: Rays) -> None:
        raise self.error


@pytest.mark.parametrize("error", [ArithmeticError("overflow"), MemoryError("too much"), ValueError("wrong")])
def test_failed_tile_is_named(error: Exception) -> None:
    plan: Any = plan_of({**SMALL, "sampling": {**SMALL["sampling"], "seed": 12}})
    object.__setattr__(plan, "intersectors", (Broken(error),))
    with pytest.raises(renderer.RenderError) as caught:
        renderer.render(plan, tile_size=10)
    message = str(caught.value)
    for part in ("pixels 0..10 x 0..10", "samples 0..1", "seed 12", type(error).__name__, str(error)):
        assert part in message


def test_callback_that_raises() -> None:
    class EnoughError(Exception):
        pass

    def stop(event: renderer.TileEvent) -> None:
        raise EnoughError

    with pytest.raises(EnoughError):
        renderer.render(plan_of(SMALL), on_tile=stop)


@pytest.mark.slow
def test_dead_worker_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first task that reaches a worker ends its process."""
    monkeypatch.setattr(rendering, "_attempt", _die)
    with pytest.raises(renderer.RenderError, match="worker process died"):
        renderer.render(plan_of(SMALL), workers=2, tile_size=8)


def _die(*_: object) -> None:
    import os

    os._exit(1)
