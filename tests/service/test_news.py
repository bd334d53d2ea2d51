"""Watching a job: long-polling, binary batches, server-sent events."""

from __future__ import annotations

import json

import httpx2
import numpy as np
import pytest

from renderer.images.files import displayed
from schemas.api.batches import FLOAT32, unpack
from schemas.scene import Display
from tests.service.conftest import Start
from tests.service.support import ON_BOTH, TIMEOUT, finish, image, job_of, long_scene, scene, submit, wait

BINARY = {"Accept": "application/octet-stream"}


@pytest.fixture
def done(client: httpx2.Client) -> str:
    job = submit(client, scene())
    finish(client, job)
    return job


def streamed(client: httpx2.Client, job: str, **headers: str) -> list[dict[str, str]]:
    """All events of a stream, field by field, until it ends."""
    events: list[dict[str, str]] = [{}]
    with client.stream("GET", f"/v1/jobs/{job}/events", headers=headers) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            if line:
                name, _, value = line.partition(": ")
                events[-1][name] = value
            elif events[-1]:
                events.append({})
    return [event for event in events if "event" in event]


def test_numbers_grow_by_one_and_each_step_comes_once(client: httpx2.Client, done: str) -> None:
    batch = client.get(f"/v1/jobs/{done}/tiles").json()
    assert [event["seq"] for event in batch["events"]] == list(range(1, len(batch["events"]) + 1))
    steps = {(event["pass_index"], event["tile"]) for event in batch["events"]}
    assert len(steps) == len(batch["events"]) == batch["progress"]["total"]
    assert batch["complete"]


def test_the_coarse_picture_comes_first(client: httpx2.Client, done: str) -> None:
    first = client.get(f"/v1/jobs/{done}/tiles").json()["events"][0]
    assert (first["pass_index"], first["x0"], first["y0"], first["x1"], first["y1"]) == (0, 0, 0, 80, 48)
    assert first["stride"] > 1


def test_a_cursor_gives_what_follows_and_nothing_twice(client: httpx2.Client) -> None:
    job = submit(client, scene(160, 96))
    seen, after, complete = [], 0, False
    while not complete:
        batch = client.get(f"/v1/jobs/{job}/tiles", params={"after": after, "wait": 5}).json()
        seen += [event["seq"] for event in batch["events"]]
        after, complete = batch["next"], batch["complete"]
    assert seen == list(range(1, len(seen) + 1))


def test_a_watcher_of_a_finished_job_is_not_kept_waiting(client: httpx2.Client, done: str) -> None:
    batch = client.get(f"/v1/jobs/{done}/tiles", params={"after": 10_000, "wait": 5}).json()
    assert batch == batch | {"events": [], "complete": True, "next": 10_000}


def test_a_batch_of_a_finished_job_paints_its_final_image(client: httpx2.Client, done: str) -> None:
    head, tiles = unpack(client.get(f"/v1/jobs/{done}/tiles", headers=BINARY).content)
    assert head.complete
    assert head.succeeded
    assert painted(tiles, 48, 80).tobytes() == image(client, done).tobytes()


@ON_BOTH
def test_batches_received_while_it_runs_paint_the_final_image(client: httpx2.Client) -> None:
    job = submit(client, scene(160, 96, samples=16))
    canvas, after, complete = np.zeros((96, 160, 3), np.float32), 0, False
    while not complete:
        answer = client.get(f"/v1/jobs/{job}/tiles", params={"after": after, "wait": 5}, headers=BINARY)
        head, tiles = unpack(answer.content)
        assert head.encoding == FLOAT32
        painted(tiles, 96, 160, canvas)
        after, complete = head.next, head.complete
    assert canvas.tobytes() == image(client, job).tobytes()


def painted(tiles: list, height: int, width: int, canvas: np.ndarray | None = None) -> np.ndarray:
    canvas = np.full((height, width, 3), np.nan, np.float32) if canvas is None else canvas
    for head, data in tiles:
        rows, columns = -(-(head.y1 - head.y0) // head.stride), -(-(head.x1 - head.x0) // head.stride)
        pixels = np.frombuffer(data, "<f4").reshape(rows, columns, 3)
        pixels = pixels.repeat(head.stride, 0).repeat(head.stride, 1)
        canvas[head.y0 : head.y1, head.x0 : head.x1] = pixels[: head.y1 - head.y0, : head.x1 - head.x0]
    return canvas


def test_a_picture_that_is_being_rendered_shows_its_tiles_in_their_places(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["progress"]["done"] >= 40)
    client.post(f"/v1/jobs/{job}/pause").raise_for_status()
    news, before = None, None
    # Tiles that were begun are finished.
    while news is None or (news[0].next, job_of(client, job)["last_seq"]) != (before, before):
        before = job_of(client, job)["last_seq"]
        news, shown = unpack(client.get(f"/v1/jobs/{job}/tiles", headers=BINARY).content), image(client, job)
    assert job_of(client, job)["state"] == "running"
    np.testing.assert_array_equal(shown, painted(news[1], 256, 256))
    client.delete(f"/v1/jobs/{job}")


def test_a_batch_in_eight_bits_has_the_codes_of_the_one_in_numbers(client: httpx2.Client, done: str) -> None:
    found = []
    for encoding in ("float32", "rgb8"):
        answer = client.get(f"/v1/jobs/{done}/tiles", headers=BINARY, params={"encoding": encoding})
        found.append(unpack(answer.content)[1])
    for (head, numbers), (same, codes) in zip(*found, strict=True):
        assert head._replace(length=head.length // 4) == same
        pixels = np.frombuffer(numbers, "<f4").reshape(-1, head.x1 - head.x0, 3)
        assert displayed(pixels, Display()).tobytes() == bytes(codes)


@ON_BOTH
def test_a_stream_reports_every_tile_and_then_the_end(client: httpx2.Client) -> None:
    job = submit(client, scene(160, 96))
    *tiles, end = streamed(client, job)
    assert [int(event["id"]) for event in tiles] == list(range(1, len(tiles) + 1))
    assert {event["event"] for event in tiles} == {"tile"}
    assert end["event"] == "end"
    assert json.loads(end["data"])["state"] == "succeeded"


def test_a_stream_continues_after_the_last_event_received(client: httpx2.Client, done: str) -> None:
    events = streamed(client, done)
    assert streamed(client, done, **{"Last-Event-ID": "3"}) == events[3:]


def test_a_silent_stream_shows_that_it_lives(start: Start) -> None:
    server = start(workers=1, heartbeat_seconds=0.01)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, long_scene())
        with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
            assert any(line.startswith(":") for line in answer.iter_lines())


def test_waiting_in_vain_ends_with_an_empty_list(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    batch = client.get(f"/v1/jobs/{job}/tiles", params={"after": 10_000, "wait": 0.2}).json()
    client.delete(f"/v1/jobs/{job}")
    assert batch["events"] == []
    assert not batch["complete"]


@ON_BOTH
def test_a_stream_ends_when_its_job_is_cancelled(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["last_seq"] > 0)
    with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
        lines = answer.iter_lines()
        next(lines)
        assert client.post(f"/v1/jobs/{job}/cancel").json()["state"] == "cancelled"
        assert any(line == "event: end" for line in lines)
