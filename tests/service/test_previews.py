"""Previews over HTTP: small pictures without jobs."""

from __future__ import annotations

import io
from typing import Any

import httpx2
import pytest
from PIL import Image

from tests.service.support import scene
from tests.service.test_bad_requests import problem_of


def ask(client: httpx2.Client, document: dict[str, Any], **rest: Any) -> httpx2.Response:
    return client.post("/v1/previews", json={"scene": document} | rest)


def picture(answer: httpx2.Response) -> Image.Image:
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png")
    return Image.open(io.BytesIO(answer.content))


@pytest.mark.parametrize(
    ("size", "side", "expected"),
    [
        pytest.param((400, 200), 128, (128, 64), id="smaller"),
        pytest.param((20, 10), 128, (20, 10), id="never-larger"),
        pytest.param((10, 640), 64, (1, 64), id="at-least-one-pixel"),
    ],
)
def test_a_preview_keeps_the_proportions(
    client: httpx2.Client, size: tuple[int, int], side: int, expected: tuple[int, int]
) -> None:
    assert picture(ask(client, scene(*size), side=side)).size == expected


def test_a_preview_shows_the_scene_and_leaves_no_job(client: httpx2.Client) -> None:
    before = client.get("/v1/jobs").json()["jobs"]
    document = scene(64, 64)
    small = picture(ask(client, document, side=16))
    assert len(small.getcolors() or ()) > 1
    assert client.get("/v1/jobs").json()["jobs"] == before


def test_how_a_scene_is_sampled_does_not_slow_its_preview(client: httpx2.Client) -> None:
    # The picture itself would take hours.
    picture(ask(client, scene(400, 400, samples=1024, light_samples=1024)))


def test_a_scene_with_a_mistake_has_no_preview(client: httpx2.Client) -> None:
    found = problem_of(ask(client, scene() | {"camera": {}}), 422)
    assert found["errors"][0]["pointer"].startswith("/scene/camera")


@pytest.mark.parametrize("side", [7, 257, 64.5, "64"])
def test_the_side_of_a_preview_is_bounded(client: httpx2.Client, side: Any) -> None:
    assert problem_of(ask(client, scene(), side=side), 422)["errors"][0]["pointer"] == "/side"
