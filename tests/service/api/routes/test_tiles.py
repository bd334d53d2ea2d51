"""Watching a job: long-polling, binary batches, server-sent events."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import numpy as np
import pytest
from sqlalchemy import text

from renderer.images.files import displayed
from schemas.api.batches import FLOAT16, unpack
from schemas.scene import Display
from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.in_process import InProcess
from tests.service.sending import MARK, problem_of
from tests.service.support import (
    ON_BOTH,
    TIMEOUT,
    finish,
    long_scene,
    scene,
    submit,
    wait,
)

BINARY = {"Accept": "application/octet-stream"}
WATCHERS = 12


def polled(client: httpx2.Client, job: str) -> list[dict[str, Any]]:
    """Every event of a job, by long-polling from the first to the last."""
    events: list[dict[str, Any]] = []
    while True:
        news = client.get(f"/v1/jobs/{job}/tiles", params={"after": len(events), "wait": 5}).json()
        events += news["events"]
        if news["complete"]:
            return events


def streamed(client: httpx2.Client, job: str, **headers: str) -> list[dict[str, str]]:
    """All events of a stream, field by field, until it ends."""
    events: list[dict[str, str]] = [{}]
    with client.stream("GET", f"/v1/jobs/{job}/events", headers=headers) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        # Or a proxy would hold them back.
        assert answer.headers["X-Accel-Buffering"] == "no"
        for line in answer.iter_lines():
            if line:
                name, _, value = line.partition(": ")
                events[-1][name] = value
            elif events[-1]:
                events.append({})
    return [event for event in events if "event" in event]


def test_event_numbers_grow_by_one_and_each_step_comes_once(api: httpx2.Client, done: str) -> None:
    batch = api.get(f"/v1/jobs/{done}/tiles").json()
    events = batch["events"]
    assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
    steps = {(event["pass_index"], event["tile"]) for event in events}
    assert len(steps) == len(events) == batch["progress"]["total"]
    assert batch["complete"]
    first = events[0]
    assert (first["pass_index"], first["x0"], first["y0"], first["x1"], first["y1"]) == (0, 0, 0, 80, 48)
    assert first["stride"] > 1


@pytest.mark.slow
def test_watchers_all_get_the_same_events_in_the_same_order(server: RunningServer) -> None:
    def watch(number: int) -> list[int]:
        with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            if number % 2:
                return [int(event["id"]) for event in streamed(client, job) if event["event"] == "tile"]
            return [event["seq"] for event in polled(client, job)]

    with httpx2.Client(base_url=server.url) as client:
        job = submit(client, scene(128, 96, samples=16, light_samples=16))
    with ThreadPoolExecutor(WATCHERS) as pool:
        reported = list(pool.map(watch, range(WATCHERS)))
    # Tiles have sides of 32 pixels here: 4 x 3 of them in three passes, after the preview.
    assert reported == [list(range(1, 3 * 12 + 2))] * WATCHERS


def test_parameters_are_checked(api: httpx2.Client, done: str) -> None:
    wrong = ({"after": -1}, {"after": MARK}, {"wait": "nan"}, {"wait": "inf"}, {"encoding": MARK})
    for query in (*wrong, {"after": 2**40}):
        problem_of(api.get(f"/v1/jobs/{done}/tiles", params=query), 422)


def test_batch_is_binary_where_that_is_preferred(api: httpx2.Client, done: str) -> None:
    forms = {
        "APPLICATION/Octet-Stream": True,
        "application/json;q=0, */*": True,
        "application/json, application/octet-stream;q=0.1": False,
        "*/*": False,
    }
    for accept, is_binary in forms.items():
        answer = api.get(f"/v1/jobs/{done}/tiles", headers={"Accept": accept})
        assert (answer.headers["Content-Type"] == "application/octet-stream") is is_binary
        assert answer.headers["Vary"] == "Accept"


def test_batch_in_eight_bits_has_the_displayed_codes(api: httpx2.Client, done: str) -> None:
    path = f"/v1/jobs/{done}/tiles"
    linear, codes = (
        unpack(api.get(path, headers=BINARY, params={"encoding": encoding}).content)[1]
        for encoding in ("float32", "rgb8")
    )
    for (head, numbers), (same, shown) in zip(linear, codes, strict=True):
        assert head._replace(length=head.length // 4) == same
        pixels = np.frombuffer(numbers, "<f4").reshape(-1, head.x1 - head.x0, 3)
        assert displayed(pixels, Display()).tobytes() == bytes(shown)


def test_batch_in_half_floats_is_rounded_and_kept_by_its_tag(api: httpx2.Client, local: InProcess) -> None:
    bright = scene(8, 8) | {"background": [1e6, 1 / 3, 0], "shapes": []}
    path = f"/v1/jobs/{finish(api, submit(api, bright))['id']}/tiles"
    half = api.get(path, headers=BINARY, params={"encoding": "float16"})
    head, [(tile, pixels)] = unpack(half.content)
    assert (head.encoding, tile.length) == (FLOAT16, 8 * 8 * 3 * 2)
    assert np.unique(np.frombuffer(pixels, "<f2").reshape(-1, 3), axis=0).tolist() == [
        [65504, np.float16(1 / 3), 0]
    ]
    known = {"If-None-Match": half.headers["ETag"], **BINARY}
    assert api.get(path, headers=known, params={"encoding": "float16"}).status_code == 304
    for other in ({"encoding": "float32"}, {"encoding": "float16", "after": 1}):
        assert api.get(path, headers=known, params=other).status_code == 200


@ON_BOTH
def test_stream_reports_every_tile_and_then_the_end(client: httpx2.Client) -> None:
    job = submit(client, scene(160, 96))
    *tiles, end = streamed(client, job)
    assert [int(event["id"]) for event in tiles] == list(range(1, len(tiles) + 1))
    assert {event["event"] for event in tiles} == {"tile"}
    assert end["event"] == "end"
    assert json.loads(end["data"])["state"] == "succeeded"
    assert streamed(client, job, **{"Last-Event-ID": "3"}) == [*tiles, end][3:]


def test_stream_of_a_damaged_job_ends(api: httpx2.Client, local: InProcess) -> None:
    job = finish(api, submit(api, scene(8, 8, samples=1)))["id"]
    with local.service.database.writing() as session:
        session.execute(text("UPDATE renders SET passes = '{' WHERE id = :id"), {"id": job})
    *_, end = streamed(api, job)
    assert end["event"] == "end"
    assert "damaged" in json.loads(end["data"])["damage"]


@pytest.mark.slow
def test_stream_that_is_idle_shows_that_it_lives(start: Start) -> None:
    server = start(workers=1, heartbeat_seconds=0.01)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, long_scene())
        with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
            assert any(line.startswith(":") for line in answer.iter_lines())


@ON_BOTH
def test_stream_ends_when_its_job_is_cancelled(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["last_seq"] > 0)
    head = client.head(f"/v1/jobs/{job}/events")
    assert head.headers["Content-Type"].startswith("text/event-stream")
    with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        lines = answer.iter_lines()
        next(lines)
        assert client.post(f"/v1/jobs/{job}/cancel").json()["state"] == "cancelled"
        assert any(line == "event: end" for line in lines)
