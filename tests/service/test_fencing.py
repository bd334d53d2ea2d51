"""A worker of a former leader that wakes late changes no picture that another has composed since."""

import hashlib
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

import renderer
from renderer import tiling
from service.storage.database.models import RenderRow
from service.storage.tiles import StoredTile, final_prefix
from service.workers.tasks import ComposeDone, ComposeTask, TileDone, TileTask
from tests.postgres_server import PostgresServer
from tests.service.failover import leads, pair
from tests.service.faulty import GATE
from tests.service.processes import workers_of
from tests.service.sending import client_of
from tests.service.support import finish, image, scene, submit, until
from tests.service.workers.bench import Bench

LAYERS = ("depth",)


def rendered(bench: Bench) -> list[StoredTile]:
    """Render all tiles of all passes that have samples, tile by tile."""
    passes = bench.plan.passes[1:]
    steps = [(tile, pass_) for pass_ in passes for tile in tiling.tiles(bench.plan, pass_, 32)]
    parts = []
    for tile, pass_ in sorted(steps, key=lambda step: (step[0].index, step[1].index)):
        done = bench.run(TileTask("job", bench.spec_sha256, tile, pass_, attempt=1))
        assert isinstance(done, TileDone)
        parts.append(StoredTile(tile, pass_, 1, done.crc32))
    return parts


def compose(parts: list[StoredTile], attempt: int) -> ComposeTask:
    return ComposeTask("job", 64, 64, tuple(parts), attempt, layers=LAYERS)


def test_worker_that_wakes_late_replaces_nothing(tmp_path: Path) -> None:
    document = scene(64, 64, samples=16)
    former, following = (Bench(tmp_path, document, layers=LAYERS) for _ in range(2))
    try:
        parts = rendered(following)
        # A time limit and a clock that is fast: the former leader's picture ends a pass earlier.
        fewer = [part for part in parts if part.pass_.index == 1]
        assert len(fewer) < len(parts)
        worker, stale = former.worker(), compose(fewer, 1)
        os.kill(worker, signal.SIGSTOP)
        former.submit(stale)
        done = following.run(compose(parts, 2))
        assert isinstance(done, ComposeDone)
        depth = following.store.get_file("job", f"{final_prefix(2)}layer-depth.npy")

        os.kill(worker, signal.SIGCONT)
        late = former.collect(1)[stale]
        assert isinstance(late, ComposeDone)
        assert late.sha256 != done.sha256
        content = following.store.get_file("job", f"{final_prefix(2)}image.npy")
        assert hashlib.sha256(content).hexdigest() == done.sha256
        assert following.store.get_file("job", f"{final_prefix(2)}layer-depth.npy") == depth
    finally:
        former.engine.close()
        following.engine.close()


@pytest.mark.slow
def test_former_leader_changes_neither_row_nor_file(
    tmp_path: Path, postgres: PostgresServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its workers wait before they write a final picture."""
    monkeypatch.setenv(GATE, str(gate := tmp_path / "gate"))
    gate.touch()
    document = scene(96, 96)
    with (
        pair(tmp_path / "data", postgres.database(), module="tests.service.faulty") as two,
        client_of(two.second) as client,
    ):

        def rows() -> list[tuple[object, ...]]:
            columns = RenderRow.compose_attempt, RenderRow.image_sha256, RenderRow.final_prefix
            with two.database.reading() as session:
                return [tuple(row) for row in session.execute(select(RenderRow.state, *columns))]

        assert (leads(two.first), leads(two.second)) == (True, False)
        job = submit(client, document)
        until((tmp_path / "gate.reached").exists)
        leader = two.first.process.pid
        workers = workers_of(leader)
        for process in (leader, *workers):
            os.kill(process, signal.SIGSTOP)
        until(lambda: leads(two.second))
        finish(client, job)
        picture = tmp_path / "data" / "jobs" / job / "2-image.npy"
        before, row = (picture.stat().st_mtime_ns, picture.read_bytes()), rows()
        assert [prefix for *_, prefix in row] == [final_prefix(2)]

        # Its workers first: a leader that continues would end them.
        gate.unlink()
        for process in workers:
            os.kill(process, signal.SIGCONT)
        until((picture.parent / "1-image.npy").exists)
        os.kill(leader, signal.SIGCONT)
        until(lambda: not leads(two.first))
        assert (picture.stat().st_mtime_ns, picture.read_bytes()) == before
        assert rows() == row
        expected = renderer.render(renderer.compile_scene(document), workers=2).image
        assert np.array_equal(image(client, job), expected)
