"""The Python clients over a bad network, and calls that are interrupted."""

import asyncio
import itertools
import sys
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from service.client import (
    AsyncClient,
    Client,
    JobCancelledError,
    JobFailedError,
    TimedOutError,
)
from service.server import RunningServer
from tests.service.flaky import Cut, Fault, Flaky, busy
from tests.service.support import TIMEOUT, long_scene, scene, until

FAULTS: list[Fault] = [Cut(0), Cut(20), Cut(300), busy(503, "0"), busy(429, "0.2")]
NUMBERS = itertools.count(1)


def endless() -> dict[str, Any]:
    """A scene that takes some seconds and that no other test submits: the same is rendered once."""
    return long_scene() | {"background": [next(NUMBERS) / 1000, 0, 0]}


@pytest.fixture
def network(server: RunningServer) -> Iterator[Flaky]:
    place = urlsplit(server.url)
    assert place.hostname
    assert place.port
    flaky = Flaky((place.hostname, place.port))
    yield flaky
    flaky.close()


@pytest.fixture(scope="module")
def done(server: RunningServer) -> str:
    """A job that has its image."""
    with Client(server.url) as client:
        return client.submit(scene(32, 24), layers=["depth"]).wait().id


def rendered(url: str, *, awaited: bool) -> tuple[str, np.ndarray]:
    """Submit a scene and stay until its image is there; the job's id and the image."""
    if not awaited:
        with Client(url, retry_seconds=TIMEOUT) as client:
            job = client.submit(scene(32, 24), anew=True).wait()
            return job.id, job.image()

    shares: list[float] = []

    async def run() -> tuple[str, np.ndarray]:
        async with AsyncClient(url, retry_seconds=TIMEOUT) as client:
            job = await client.submit(scene(32, 24), anew=True)
            await job.wait(on_progress=lambda batch: shares.append(batch.progress.share))
            assert shares[-1] == 1
            return job.id, await job.image()

    return asyncio.run(run())


@pytest.mark.parametrize("awaited", [False, True], ids=["client", "async client"])
def test_broken_connections_cost_time_and_nothing_else(
    server: RunningServer, network: Flaky, *, awaited: bool
) -> None:
    with Client(server.url) as client:
        network.faults = deque(FAULTS)
        job_id, image = rendered(network.url, awaited=awaited)
        assert np.array_equal(image, client.get(job_id).image())
        assert not network.faults
    posts = [request for request in network.requests if request.startswith(b"POST /v1/jobs ")]
    lines = {line for post in posts for line in post.lower().split(b"\r\n") if b"idempotency" in line}
    # The submission was repeated, under one key.
    assert (len(posts) > 1, len(lines)) == (True, 1)


def test_retry_seconds_begin_with_the_first_failure(network: Flaky, server: RunningServer) -> None:
    with Client(server.url) as direct, Client(network.url, retry_seconds=0.5) as client:
        job = direct.submit(endless())
        after = next(iter(direct.follow(job.id))).next
        # The server holds its answer back for longer than the client repeats requests; then it is lost.
        network.faults = deque([Cut(0)])
        batch = client.tiles(job.id, after=after + 10_000, wait=0.8)
        assert (batch.events, len(network.requests)) == ((), 2)
        direct.cancel(job.id)


def test_tiles_arrive_one_by_one_over_a_bad_network(network: Flaky) -> None:
    network.faults = deque([None, Cut(2000), Cut(40)])
    with Client(network.url) as client:
        job = client.submit(scene(96, 64, samples=16), anew=True)
        canvas = np.zeros((job.height, job.width, 3), np.float32)
        for tile in job.tiles():
            tile.paint(canvas)
        assert job.done
        assert np.array_equal(canvas, job.image())


def test_cancelled_task_closes_its_connection_and_its_job_runs(network: Flaky) -> None:
    async def run() -> tuple[str, str]:
        async with AsyncClient(network.url) as client:
            job = await client.submit(endless())
            waiting = asyncio.create_task(job.wait())
            await asyncio.to_thread(until, lambda: any(b"/tiles" in piece for piece in network.requests))
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError) as caught:
                await waiting
            await asyncio.to_thread(until, lambda: network.open == 0)
            state = (await job.refresh()).state
            await job.cancel()
            return state, "".join(caught.value.__notes__)

    state, notes = asyncio.run(run())
    assert state in {"queued", "running"}
    assert "client.wait(" in notes


def test_image_comes_as_array_as_pillow_and_in_files(
    server: RunningServer, done: str, tmp_path: Path
) -> None:
    with Client(server.url) as client:
        job = client.get(done)
        image = job.image()
        assert (image.shape, image.dtype) == ((24, 32, 3), np.float32)
        assert np.array_equal(np.load(job.save(tmp_path / "a.npy")), image)
        assert Image.open(job.save(str(tmp_path / "a.png"))).tobytes() == job.pillow().tobytes()
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy", "a.png"]
        with pytest.raises(ValueError, match=r"\.png"):
            job.save(tmp_path / "a.jpg")
        assert list(job.layers) == ["depth"]
        assert job.layers["depth"].shape == (24, 32)
        with pytest.raises(KeyError, match="depth"):
            job.layers["normal"]
        numbers = [event.seq for event in client.events(done)]

    async def awaited() -> None:
        async with AsyncClient(server.url) as client:
            job = await client.get(done)
            assert np.array_equal(await job.image(), image)
            assert (await job.pillow()).size == (32, 24)
            assert np.array_equal(np.load(await job.save(tmp_path / "b.npy")), image)
            assert (await job.layers["depth"]).shape == (24, 32)
            assert [event.seq async for event in client.events(done)] == numbers
            assert [tile async for tile in job.tiles()]

    asyncio.run(awaited())


def test_time_out_names_the_job(server: RunningServer) -> None:
    with Client(server.url) as client:
        job = client.submit(endless())
        with pytest.raises(TimedOutError, match=rf"client.wait\('{job.id}'\)") as caught:
            job.image(timeout=0.1)
        assert caught.value.job_id == job.id
        job.cancel()
        assert job.state == "cancelled"
        with pytest.raises(JobCancelledError):
            next(job.tiles(), None)


def test_card_of_a_notebook_shows_the_picture(server: RunningServer, monkeypatch: pytest.MonkeyPatch) -> None:
    pages: list[str] = []

    def shown(page: str, *, display_id: bool) -> SimpleNamespace:
        assert display_id
        pages.append(page)
        return SimpleNamespace(update=pages.append)

    # As much of IPython as a notebook's output needs; it is no dependency.
    kernel = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: kernel))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(HTML=str, display=shown))
    with Client(server.url) as client:
        named = client.submit(scene(32, 24) | {"name": "<b>&"}).wait()
        card = named._repr_html_()
        assert pages[-1] == card
        assert named._repr_png_() == client.picture(named.id)._repr_png_() == client.picture(named.id).content
        assert client.picture(named.id, "npy")._repr_png_() is None
        assert ("&lt;b&gt;&amp;" in card, card.count("data:image/png;base64,")) == (True, 1)
        stopped = client.submit(endless()).cancel()
        assert (stopped._repr_png_(), "<img" in stopped._repr_html_()) == (None, False)


def test_fields_of_a_submission_reach_the_service(server: RunningServer) -> None:
    document = scene(16, 8) | {"background": [0.2, 0.1, 0.3]}
    with Client(server.url) as client:
        first = client.submit(document, labels={"who": "ada"}, priority=3, wait=5)
        assert (first.state, first.labels, first.priority) == ("succeeded", {"who": "ada"}, 3)
        assert "shared" in {entry.event for entry in client.submit(document).log().entries}
        anew = client.submit(document, anew=True)
        assert "shared" not in {entry.event for entry in anew.log().entries}
        late = client.submit(endless(), time_limit=0.01)
        with pytest.raises(JobFailedError) as caught:
            late.wait()
        assert (caught.value.failure.code, late.state, late.done) == ("time_limit", "failed", True)
