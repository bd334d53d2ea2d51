"""Requests that share one picture."""

import copy
from collections.abc import Callable
from typing import Any

import pytest

from schemas.api.jobs import JobRequest
from service.jobs.canonical import spec_of
from tests.service.support import scene

Change = Callable[[dict[str, Any]], Any]

SAME: dict[str, Change] = {
    "name": lambda request: request["scene"].update(name="other"),
    "labels": lambda request: request.update(labels={"a": "b"}),
    "priority": lambda request: request.update(priority=3),
    "order of materials": lambda request: request["scene"].update(
        materials=dict(reversed(request["scene"]["materials"].items()))
    ),
    "written default": lambda request: request["scene"]["camera"].update(up=[0, 1, 0]),
    "number with a point": lambda request: request["scene"]["camera"].update(vertical_fov=40.0),
    "samples as a quality": lambda request: request.update(
        quality={"mode": "fixed", "antialiasing": {"pattern": "uniform", "samples": 1}}
    ),
}
OTHER: dict[str, Change] = {
    "camera": lambda request: request["scene"]["camera"].update(vertical_fov=41),
    "samples": lambda request: request.update(quality={"mode": "fixed", "light": {"samples": 4}}),
    "precision": lambda request: request.update(quality={"mode": "fixed", "precision": "double"}),
    "layers": lambda request: request.update(layers=["depth"]),
    "display": lambda request: request["scene"].update(display={"exposure": 1}),
    "seed": lambda request: request["scene"]["sampling"].update(seed=8),
    "name of a shape": lambda request: request["scene"]["shapes"][0].update(name="other"),
    "target": lambda request: request.update(quality={"mode": "target", "error": 0.01}),
}


def spec(change: Change = lambda _: None) -> bytes:
    request = {"scene": copy.deepcopy(scene(32, 32, samples=1, light_samples=1))}
    change(request)
    return spec_of(JobRequest.model_validate(request)).content


@pytest.mark.parametrize("change", SAME.values(), ids=SAME)
def test_change_leaves_the_picture_the_same(change: Change) -> None:
    assert spec(change) == spec()


@pytest.mark.parametrize("change", OTHER.values(), ids=OTHER)
def test_change_makes_another_picture(change: Change) -> None:
    assert spec(change) != spec()


@pytest.mark.parametrize("quality", [{"precision": "double"}, {"error": 0.01}, {"mode": "fixed"}], ids=str)
def test_spec_is_read_again(quality: dict[str, Any]) -> None:
    kept = spec(lambda request: request.update(quality=quality))
    assert spec_of(JobRequest.model_validate_json(kept)).content == kept
