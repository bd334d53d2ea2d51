"""A part of a picture is rendered first on request."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import httpx2
import pytest

from tests.service.conftest import Start
from tests.service.support import TIMEOUT, finish, image, long_scene, scene, submit
from tests.service.test_bad_requests import problem_of

LOWER_RIGHT = {"x0": 40, "y0": 40, "x1": 64, "y1": 64}
"""In tiles of 16 pixels, the four in that corner of a picture of 64 x 64."""


@pytest.mark.slow
def test_tiles_of_a_region_come_first_in_each_pass_and_the_picture_is_the_same(start: Start) -> None:
    server = start(workers=1, tile_size=16)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        busy = submit(client, long_scene())
        job = submit(client, scene(64, 64))
        answer = client.post(f"/v1/jobs/{job}/focus", json=LOWER_RIGHT)
        assert answer.status_code == 204, answer.text
        client.post(f"/v1/jobs/{busy}/cancel")
        finish(client, job)
        passes: defaultdict[int, list[int]] = defaultdict(list)
        for event in client.get(f"/v1/jobs/{job}/tiles").json()["events"]:
            passes[event["pass_index"]].append(event["tile"])
        corner = [row * 4 + column for row in (2, 3) for column in (2, 3)]
        rest = [tile for tile in range(16) if tile not in corner]
        assert passes == {0: [0], 1: corner + rest, 2: corner + rest}
        plain = submit(client, scene(64, 64) | {"name": "in the usual order"})
        finish(client, plain)
        assert (image(client, job) == image(client, plain)).all()


@pytest.mark.parametrize(
    ("region", "pointer"),
    [
        (LOWER_RIGHT | {"x1": 40}, ""),
        (LOWER_RIGHT | {"y0": -1}, "/y0"),
        (LOWER_RIGHT | {"x0": 1.5}, "/x0"),
        ({"x0": 0, "y0": 0, "x1": 1}, ""),
    ],
)
def test_a_region_without_pixels_is_refused(client: httpx2.Client, region: Any, pointer: str) -> None:
    job = submit(client, scene(16, 16, samples=1, light_samples=1))
    finish(client, job)
    found = problem_of(client.post(f"/v1/jobs/{job}/focus", json=region), 422)
    assert found["errors"][0]["pointer"] == pointer


def test_a_finished_job_stays_as_it_is(client: httpx2.Client) -> None:
    job = submit(client, scene(16, 16, samples=1, light_samples=1))
    finish(client, job)
    assert client.post(f"/v1/jobs/{job}/focus", json=LOWER_RIGHT).status_code == 204
