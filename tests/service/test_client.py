"""The Python clients over a bad network, and calls that are interrupted."""

from __future__ import annotations

import asyncio
import itertools
import sys
import types
from collections import deque
from collections.abc import Iterator
from contextlib import aclosing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from schemas.api.administration import Role
from schemas.api.jobs import TileBatch
from service.access import keys
from service.client import (
    AsyncClient,
    Client,
    JobCancelledError,
    JobFailedError,
    NotAllowedError,
    RequestInvalidError,
    TimedOutError,
    UnexpectedAnswerError,
    UnreachableError,
)
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from tests.service.conftest import Start
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

    async def run() -> tuple[str, np.ndarray]:
        async with AsyncClient(url, retry_seconds=TIMEOUT) as client:
            job = await client.submit(scene(32, 24), anew=True)
            await job.wait()
            return job.id, await job.image()

    return asyncio.run(run())


@pytest.mark.parametrize("awaited", [False, True], ids=["client", "async client"])
def test_connections_that_break_cost_time_and_nothing_else(
    server: RunningServer, network: Flaky, awaited: bool
) -> None:
    with Client(server.url) as client:
        network.faults = deque(FAULTS)
        job_id, image = rendered(network.url, awaited=awaited)
        assert np.array_equal(image, client.get(job_id).image())
        assert not network.faults
    posts = [request for request in network.requests if request.startswith(b"POST /v1/jobs ")]
    assert len(posts) > 1
    assert (
        len({line for post in posts for line in post.lower().split(b"\r\n") if b"idempotency" in line}) == 1
    )


@pytest.mark.parametrize("awaited", [False, True], ids=["client", "async client"])
@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        (busy(503, "3600"), UnexpectedAnswerError),
        (busy(503, "nonsense"), UnexpectedAnswerError),
        (Cut(20), UnreachableError),
    ],
    ids=["too long a pause", "no pause named", "broken"],
)
def test_requests_are_repeated_only_for_retry_seconds(
    network: Flaky, done: str, fault: Fault, kind: type[Exception], awaited: bool
) -> None:
    network.faults = deque([fault] * 50)

    def ask() -> None:
        with Client(network.url, retry_seconds=0.3) as client:
            client.get(done)

    async def ask_awaited() -> None:
        async with AsyncClient(network.url, retry_seconds=0.3) as client:
            await client.get(done)

    with pytest.raises(kind) as caught:
        asyncio.run(ask_awaited()) if awaited else ask()
    if isinstance(caught.value, UnreachableError):
        assert caught.value.job_id == done
    assert len(network.requests) >= 1 + isinstance(fault, Cut)
    assert network.faults


def test_retry_seconds_begin_with_the_first_failure_and_not_with_the_request(
    network: Flaky, server: RunningServer
) -> None:
    with Client(server.url) as direct, Client(network.url, retry_seconds=0.5) as client:
        job = direct.submit(endless())
        after = next(iter(direct.follow(job.id))).next
        # The server holds its answer back for longer than the client repeats requests; then it is lost.
        network.faults = deque([Cut(0)])
        batch = client.tiles(job.id, after=after + 10_000, wait=0.8)
        assert (batch.events, len(network.requests)) == ((), 2)
        direct.cancel(job.id)


def test_tiles_arrive_one_by_one_until_the_image_is_there(network: Flaky, server: RunningServer) -> None:
    network.faults = deque([None, Cut(2000), Cut(40)])
    with Client(network.url) as client:
        job = client.submit(scene(96, 64, samples=16), anew=True)
        canvas = np.zeros((job.height, job.width, 3), np.float32)
        for tile in job.tiles():
            tile.paint(canvas)
        assert job.done
        assert np.array_equal(canvas, job.image())

    async def painted() -> np.ndarray:
        async with AsyncClient(network.url) as client:
            job = await client.submit(scene(96, 64, samples=16), anew=True)
            canvas = np.zeros((job.height, job.width, 3), np.float32)
            async for tile in job.tiles():
                tile.paint(canvas)
            return canvas

    assert np.array_equal(canvas, asyncio.run(painted()))


def test_a_cancelled_task_closes_its_connection_and_the_job_keeps_running(
    network: Flaky, server: RunningServer
) -> None:
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


def test_leaving_a_stream_early_closes_its_connection(network: Flaky, done: str) -> None:
    async def first() -> int:
        async with AsyncClient(network.url) as client:
            async with aclosing(client.events(done)) as events:
                found = (await anext(events)).seq
            await asyncio.to_thread(until, lambda: network.open == 0)
            return found

    assert asyncio.run(first()) == 1


def test_both_clients_report_the_same_events(server: RunningServer, done: str) -> None:
    async def reported() -> list[int]:
        async with AsyncClient(server.url) as client:
            return [event.seq async for event in client.events(done)]

    with Client(server.url) as client:
        assert asyncio.run(reported()) == [event.seq for event in client.events(done)]


def test_a_job_gives_its_image_as_array_pillow_and_files(
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

    async def awaited() -> None:
        async with AsyncClient(server.url) as client:
            job = await client.get(done)
            assert np.array_equal(await job.image(), image)
            assert (await job.pillow()).size == (32, 24)
            assert np.array_equal(np.load(await job.save(tmp_path / "b.npy")), image)
            assert (await job.layers["depth"]).shape == (24, 32)

    asyncio.run(awaited())


def test_where_a_finished_image_is_asked_for_it_is_waited_for(server: RunningServer) -> None:
    with Client(server.url) as client:
        job = client.submit(scene(64, 48, samples=16), anew=True)
        assert job.image().shape == (48, 64, 3)
        assert (job.state, job.progress.share, job.done) == ("succeeded", 1, True)
        assert "100% of 64" in repr(job)


def test_a_time_out_names_the_job_and_how_to_wait_again(server: RunningServer) -> None:
    with Client(server.url) as client:
        job = client.submit(endless())
        with pytest.raises(TimedOutError, match=rf"client.wait\('{job.id}'\)") as caught:
            job.image(timeout=0.1)
        assert caught.value.job_id == job.id
        job.cancel()
        assert job.state == "cancelled"
        with pytest.raises(JobCancelledError):
            next(job.tiles(), None)


def test_progress_may_be_reported_to_a_function_or_a_coroutine_function(server: RunningServer) -> None:
    shares: list[float] = []

    async def note(batch: TileBatch) -> None:
        shares.append(batch.progress.share)

    async def run() -> None:
        async with AsyncClient(server.url) as client:
            job = await client.submit(scene(32, 24))
            await job.wait(on_progress=note)
            assert shares.pop() == 1
            shares.clear()
            await job.wait(on_progress=lambda batch: shares.append(batch.progress.share))
            assert shares == [1]

    asyncio.run(run())


def test_what_is_wrong_with_a_scene_is_reported_by_both_clients_in_its_own_lines(
    server: RunningServer, tmp_path: Path
) -> None:
    path = tmp_path / "scene.json"
    path.write_text('{"version": 1,\n "camra": {}}')

    async def submit() -> None:
        async with AsyncClient(server.url) as client:
            await client.submit(path)

    place = r"/camra \(line 2, column 2\)"
    with Client(server.url) as client, pytest.raises(RequestInvalidError, match=place) as here:
        client.submit(path)
    with pytest.raises(RequestInvalidError, match=place) as there:
        asyncio.run(submit())
    assert str(here.value) == str(there.value)


class Notebook(types.ModuleType):
    """As much of IPython as a notebook's output needs; it is no dependency."""

    def __init__(self) -> None:
        super().__init__("IPython")
        self.kernel = object()
        self.pages: list[str] = []
        self.display = types.ModuleType("IPython.display")
        self.display.HTML = str  # type: ignore[attr-defined]
        self.display.display = self.shown  # type: ignore[attr-defined]

    def get_ipython(self) -> Notebook:
        return self

    def shown(self, page: Any, *, display_id: bool) -> Notebook:
        assert display_id
        self.pages.append(page)
        return self

    def update(self, page: Any) -> None:
        self.pages.append(page)


def test_a_notebook_shows_a_job_that_is_waited_for_until_it_is_complete(
    server: RunningServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    notebook = Notebook()
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", notebook.display)

    async def awaited() -> str:
        async with AsyncClient(server.url) as client:
            job = await client.submit(scene(32, 24))
            await job.wait()
            return job._repr_html_()

    with Client(server.url) as client:
        named = client.submit(scene(32, 24) | {"name": "<b>&"}).wait()
        card = named._repr_html_()
        assert named._repr_png_() == client.picture(named.id)._repr_png_() == client.picture(named.id).content
        assert client.picture(named.id, "npy")._repr_png_() is None
    assert "&lt;b&gt;&amp;" in card
    assert notebook.pages[-1] == card
    assert card.count("data:image/png;base64,") == 1
    notebook.pages.clear()
    assert "100% of 32" in asyncio.run(awaited())
    assert "data:image/png" in notebook.pages[-1]


def test_a_card_of_what_has_no_picture_is_made_at_once_and_without_one(
    network: Flaky, server: RunningServer, done: str
) -> None:
    with Client(network.url) as client:
        job = client.submit(endless()).cancel()
        network.requests.clear()
        assert job._repr_png_() is None
        assert f"{job.id}: cancelled" in job._repr_html_()
        assert "<img" not in job._repr_html_()
        assert len(network.requests) == 3
        assert "content" not in repr(client.picture(done))


def test_a_submission_whose_answer_was_lost_is_one_job_however_often_it_was_sent(
    network: Flaky, server: RunningServer
) -> None:
    network.faults = deque([Cut(0), Cut(20), Cut(200)])
    with Client(network.url, retry_seconds=TIMEOUT) as client:
        job = client.submit(scene(16, 8) | {"name": "sent four times"})
        named = [found.id for found in client.jobs() if found.name == "sent four times"]
    assert not network.faults
    assert named == [job.id]


def test_what_is_requested_of_a_job_reaches_the_service(server: RunningServer) -> None:
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


def test_a_service_with_keys_lets_in_their_owners(start: Start, tmp_path: Path) -> None:
    database = Database(Settings(data=tmp_path).database_url)
    upgrade(database)
    with database.writing() as session:
        key = str(keys.add(session, "ada", Role.SUBMIT))
    database.close()
    server = start(workers=1)
    with Client(server.url) as stranger, pytest.raises(NotAllowedError) as caught:
        stranger.submit(scene(16, 8))
    assert caught.value.status == 401
    with Client(server.url, key=key) as client:
        assert client.submit(scene(16, 8)).wait().user == "ada"

    async def user() -> str | None:
        async with AsyncClient(server.url, key=key) as client:
            return (await client.submit(scene(16, 8))).user

    assert asyncio.run(user()) == "ada"
