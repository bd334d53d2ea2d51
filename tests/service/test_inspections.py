"""Pixels explained over HTTP."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

import renderer
from accuracy.inspection import inspect, inspection_plan
from schemas.api.inspections import Inspection
from schemas.api.request_pointers import in_scene
from service.server import RunningServer
from tests.service.support import TIMEOUT, finish, scene, submit
from tests.service.test_bad_requests import problem_of

BEHIND_THE_BALL = (30, 27)


@pytest.fixture(scope="module")
def finished(server: RunningServer) -> Iterator[tuple[httpx2.Client, str]]:
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, scene())
        finish(client, job)
        yield client, job


def ask(client: httpx2.Client, job: str, pixel: Any) -> httpx2.Response:
    return client.post(f"/v1/jobs/{job}/inspections", json=pixel)


def test_a_pixel_is_explained_as_the_renderer_does(finished: tuple[httpx2.Client, str]) -> None:
    client, job = finished
    x, y = BEHIND_THE_BALL
    answer = ask(client, job, {"x": x, "y": y})
    assert answer.status_code == 200, answer.text
    plan = inspection_plan(renderer.load_scene(scene()))
    assert in_scene(Inspection.model_validate(answer.json())) == inspect(plan, x, y)


def test_a_dark_pixel_says_which_shape_stands_before_the_light(
    finished: tuple[httpx2.Client, str],
) -> None:
    client, job = finished
    reported = ask(client, job, dict(zip("xy", BEHIND_THE_BALL, strict=True))).json()
    assert reported["reasons"][0]["text"].startswith("Nothing lights it")
    assert reported["reasons"][0]["pointers"] == ["/scene/lights/0", "/scene/shapes/1"]
    assert reported["ray"]["surface"]["lights"][0]["blockers"] == [
        {"pointer": "/scene/shapes/1", "name": None, "shape": 1, "points": 4}
    ]


def test_a_job_that_has_not_begun_can_be_asked_about(client: httpx2.Client) -> None:
    job = submit(client, scene(), quality={"mode": "target", "error": 0.02})
    assert ask(client, job, {"x": 0, "y": 0}).json()["reasons"][0]["code"] == "background"
    finish(client, job)


@pytest.mark.parametrize(
    ("pixel", "pointer"),
    [
        ({"x": 80, "y": 0}, "/x"),
        ({"x": 0, "y": 48}, "/y"),
        ({"x": -1, "y": 0}, "/x"),
        ({"x": 1.5, "y": 0}, "/x"),
        ({"x": 1}, ""),
    ],
)
def test_a_pixel_that_is_none_is_pointed_at(
    finished: tuple[httpx2.Client, str], pixel: Any, pointer: str
) -> None:
    client, job = finished
    assert problem_of(ask(client, job, pixel), 422)["errors"][0]["pointer"] == pointer


def test_an_unknown_job_has_no_pixels(client: httpx2.Client) -> None:
    problem_of(ask(client, "0" * 16, {"x": 0, "y": 0}), 404)
