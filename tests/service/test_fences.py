"""A worker of a former leader that wakes late changes no picture that another has composed since."""

from __future__ import annotations

import hashlib
import os
import queue
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select, text

import renderer
from benchmarks.chaos.faulty import GATE
from benchmarks.load.processes import workers_of
from renderer import tiling
from schemas.api.jobs import JobRequest
from schemas.limits import Limits
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore, final_prefix
from service.workers.slots import SlotEngine
from service.workers.tasks import ComposeDone, ComposeTask, JobTask, Outcome, Task, TileDone, TileTask
from service.workers.worker import WorkerSetup
from tests.postgres_server import PostgresServer
from tests.service.conftest import Start
from tests.service.support import finish, image, scene, submit, until
from tests.service.test_several_servers import client_of, leads

REPORT_SECONDS = 60.0
LAYERS = ("depth",)


class Bench:
    """Two engines with one worker each over one store: that of a former leader, and that of the next."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.store = TileStore(Folder(folder / "jobs"))
        request = JobRequest.model_validate({"scene": scene(64, 64, samples=16), "layers": list(LAYERS)})
        self.plan = renderer.compile_scene(request.scene, layers=LAYERS)
        self.store.put_spec("job", request.model_dump_json(exclude_none=True).encode())
        self.reports: queue.Queue[tuple[Task, Outcome]] = queue.Queue()
        setup = WorkerSetup(str(folder), Limits(), 4 << 30)
        self.former, self.workers = self._engine(setup, stack)
        self.next, _ = self._engine(setup, stack)

    def _engine(self, setup: WorkerSetup, stack: ExitStack) -> tuple[SlotEngine, set[int]]:
        before = set(workers_of(os.getpid()))
        engine = SlotEngine(1, setup)
        engine.start(lambda task, outcome: self.reports.put((task, outcome)))
        stack.callback(engine.close)
        until(engine.alive)
        return engine, set(workers_of(os.getpid())) - before

    def run(self, engine: SlotEngine, task: JobTask) -> Outcome:
        engine.submit(task)
        reported, outcome = self.reports.get(timeout=REPORT_SECONDS)
        assert reported is task
        return outcome

    def rendered(self) -> list[StoredTile]:
        """Render all tiles of all passes that have samples, tile by tile."""
        steps = [
            (pass_, tile) for pass_ in self.plan.passes[1:] for tile in tiling.tiles(self.plan, pass_, 32)
        ]
        parts = []
        for pass_, tile in sorted(steps, key=lambda step: (step[1].index, step[0].index)):
            done = self.run(self.next, TileTask("job", "hash", tile, pass_, attempt=1))
            assert isinstance(done, TileDone)
            parts.append(StoredTile(tile, pass_, 1, done.crc32))
        return parts

    def compose(self, parts: list[StoredTile], attempt: int) -> ComposeTask:
        return ComposeTask("job", 64, 64, tuple(parts), attempt, layers=LAYERS)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with ExitStack() as stack:
        yield Bench(tmp_path, stack)


def test_a_stopped_worker_that_wakes_after_another_has_composed_replaces_nothing(bench: Bench) -> None:
    parts = bench.rendered()
    # A time limit and a clock that is fast: the former leader's picture ends a pass earlier.
    fewer = [part for part in parts if part.pass_.index == 1]
    assert len(fewer) < len(parts)
    for worker in bench.workers:
        os.kill(worker, signal.SIGSTOP)
    stale = bench.compose(fewer, 1)
    bench.former.submit(stale)
    done = bench.run(bench.next, bench.compose(parts, 2))
    assert isinstance(done, ComposeDone)
    depth = bench.store.get_file("job", f"{final_prefix(2)}layer-depth.npy")

    for worker in bench.workers:
        os.kill(worker, signal.SIGCONT)
    reported, late = bench.reports.get(timeout=REPORT_SECONDS)
    assert reported is stale
    assert isinstance(late, ComposeDone)
    assert late.sha256 != done.sha256
    content = bench.store.get_file("job", f"{final_prefix(2)}image.npy")
    assert hashlib.sha256(content).hexdigest() == done.sha256
    assert bench.store.get_file("job", f"{final_prefix(2)}layer-depth.npy") == depth


def test_pictures_of_version_0_1_are_found_under_their_names(start: Start) -> None:
    """Their rows have no prefix, and their files none either."""
    server = start()
    with client_of(server) as client:
        job = submit(client, scene(32, 32, samples=1), layers=["depth"])
        finish(client, job)
        names = ("image.npy", "image.png", "layers/depth.npy")
        before = [client.get(f"/v1/jobs/{job}/{name}").content for name in names]
        folder = server.data / "jobs" / job
        for path in folder.glob("1-*"):
            path.rename(folder / path.name.removeprefix("1-"))
        database = Database(f"sqlite:///{server.data / 'penumbra.sqlite'}")
        with database.writing() as session:
            session.execute(text("UPDATE renders SET final_prefix = ''"))
        database.close()
        assert [client.get(f"/v1/jobs/{job}/{name}").content for name in names] == before
        (folder / "image.png").unlink()
        assert client.get(f"/v1/jobs/{job}/image.png").content == before[1]
        assert (folder / "image.png").exists()


@pytest.fixture
def former(
    tmp_path: Path, postgres: PostgresServer, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[RunningServer, RunningServer, Database]]:
    """A leader whose workers wait before they write a final picture, the next server, and their database."""
    monkeypatch.setenv(GATE, str(tmp_path / "gate"))
    (tmp_path / "gate").touch()
    url = postgres.database()
    settings = Settings(
        data=tmp_path / "data", database=url, port=0, workers=1, tile_size=48, log_level="error"
    )
    database = Database(url)
    with running(settings, module="benchmarks.chaos.faulty") as leader, running(settings) as other:
        yield leader, other, database
    database.close()


def rows(database: Database) -> list[tuple[object, ...]]:
    with database.reading() as session:
        columns = RenderRow.state, RenderRow.compose_attempt, RenderRow.image_sha256, RenderRow.final_prefix
        return [tuple(row) for row in session.execute(select(*columns))]


@pytest.mark.slow
def test_a_former_leader_and_its_workers_that_continue_change_neither_row_nor_file(
    former: tuple[RunningServer, RunningServer, Database], tmp_path: Path
) -> None:
    leader, other, database = former
    assert (leads(leader), leads(other)) == (True, False)
    document = scene(96, 96)
    with client_of(other) as client:
        job = submit(client, document)
        until((tmp_path / "gate.reached").exists)
        stopped = [leader.process.pid, *workers_of(leader.process.pid)]
        for process in stopped:
            os.kill(process, signal.SIGSTOP)
        until(lambda: leads(other))
        finish(client, job)
        picture = tmp_path / "data" / "jobs" / job / "2-image.npy"
        before, row = (picture.stat().st_mtime_ns, picture.read_bytes()), rows(database)
        assert [prefix for *_, prefix in row] == [final_prefix(2)]

        # Its workers first: a leader that continues would end them.
        (tmp_path / "gate").unlink()
        for process in stopped[1:]:
            os.kill(process, signal.SIGCONT)
        until((picture.parent / "1-image.npy").exists)
        os.kill(leader.process.pid, signal.SIGCONT)
        until(lambda: not leads(leader))
        assert (picture.stat().st_mtime_ns, picture.read_bytes()) == before
        assert rows(database) == row
        expected = renderer.render(renderer.compile_scene(document), workers=2).image
        assert np.array_equal(image(client, job), expected)
