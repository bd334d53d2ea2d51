"""Rays over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from tests.service.support import scene
from tests.service.test_bad_requests import problem_of

ORIGINS = [[0.0, 2.0, 6.0], [0.0, 2.0, 6.0], [3.0, 5.0, 3.0]]
DIRECTIONS = [[0.0, -1.0, -5.0], [0.0, 1.0, 0.0], [0.0, -2.5, 0.0]]


def ask(client: httpx2.Client, **changes: Any) -> httpx2.Response:
    return client.post(
        "/v1/traces", json={"scene": scene(), "origins": ORIGINS, "directions": DIRECTIONS} | changes
    )


def test_rays_hit_what_the_renderer_says(client: httpx2.Client) -> None:
    answer = ask(client).json()
    hits = renderer.trace(renderer.compile_scene(scene()), np.array(ORIGINS), np.array(DIRECTIONS))
    assert answer["shape"] == hits.shape.tolist() == [1, -1, 0]
    assert answer["primitive"] == hits.primitive.tolist()
    assert answer["visibility"] == hits.visibility.tolist()
    for name in ("t", "position", "normal", "uv"):
        assert answer[name][1] is None
        assert [answer[name][i] for i in (0, 2)] == [getattr(hits, name)[i].tolist() for i in (0, 2)]
    assert answer["t"][2] == 2.0


def test_no_rays_hit_nothing(client: httpx2.Client) -> None:
    answer = ask(client, origins=[], directions=[]).json()
    assert answer == {name: [] for name in answer}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"directions": DIRECTIONS[:2]}, "/directions"),
        ({"origins": [[0, 0]] * 3}, "/origins/0"),
        ({"directions": [[0, 0, 0], *DIRECTIONS[1:]]}, "/directions/0"),
        ({"origins": [["1", 0, 0], *ORIGINS[1:]]}, "/origins/0/0"),
        ({"origins": [*ORIGINS[:2], [0, -1e200, 0]]}, "/origins/2/1"),
        ({"directions": [DIRECTIONS[0], [0, 1e-310, 0], DIRECTIONS[2]]}, "/directions/1"),
        ({"directions": [*DIRECTIONS[:2], [0, 0, 1e300]]}, "/directions/2"),
        ({"origins": [[0, 0, 0]] * 1001, "directions": [[0, 0, 1]] * 1001}, "/origins"),
    ],
)
def test_rays_that_make_no_sense_are_pointed_at(
    client: httpx2.Client, changes: dict[str, Any], pointer: str
) -> None:
    found = problem_of(ask(client, **changes), 422)["errors"]
    assert found[0]["pointer"].startswith(pointer)
