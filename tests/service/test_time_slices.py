"""A tile that takes longer than its time slice: it is preempted, charged, and continued where it was."""

import time
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import httpx2
import pytest

import renderer
from renderer.adaptive.target_plan import target_plan
from schemas.api.administration import Role
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore
from service.workers.heartbeats import Lease
from service.workers.passes import PassWorker
from service.workers.tasks import Outcome, Preempted, SampleTask, TileDone, pass_of
from tests.service.conftest import Start
from tests.service.sending import bearer, make_keys
from tests.service.support import TIMEOUT, finish, job_of, scene, submit, until
from tests.service.workers.bench import Bench


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Time slices that are over after the fewest rays."""
    bench = Bench(tmp_path, scene(48, 48), lease=Lease(slice_seconds=0.0))
    yield bench
    bench.engine.close()


def test_preempted_tile_is_continued(bench: Bench) -> None:
    task, slices = bench.tile(), 0
    while isinstance(outcome := bench.run(task), Preempted):
        assert outcome.cpu_seconds > 0
        task, slices = replace(task, attempt=task.attempt + 1, resumed=True), slices + 1
    assert isinstance(outcome, TileDone)
    assert slices > 2
    expected = renderer.render_tile(bench.plan, task.tile, task.pass_)
    stored = bench.store.get_tile("job", StoredTile(task.tile, task.pass_, task.attempt, outcome.crc32))
    assert stored.tobytes() == expected.pixels.tobytes()
    assert outcome.counts == expected.counts


@pytest.mark.parametrize("lost", [b"", b"damaged"], ids=["missing", "damaged"])
def test_tile_begins_anew_where_its_slices_are_lost(bench: Bench, tmp_path: Path, lost: bytes) -> None:
    task = bench.tile()
    assert isinstance(bench.run(task), Preempted)
    (unfinished,) = (tmp_path / "jobs" / "job" / "tiles").glob("*.unfinished")
    unfinished.write_bytes(lost) if lost else unfinished.unlink()
    assert isinstance(bench.run(replace(task, attempt=2, resumed=True)), Preempted)
    assert unfinished.stat().st_size > 1000


def test_tile_of_target_quality_is_given_up_unless_it_is_a_pixel(tmp_path: Path) -> None:
    quality = TargetQuality(mode="target", error=0.01)
    plan = target_plan(renderer.compile_scene(scene(32, 32), quality))
    store = TileStore(Folder(tmp_path))
    store.put_spec("job", b"")

    def sampled(tile: Tile, slice_seconds: float) -> Outcome:
        task = SampleTask("job", "", tile, pass_of(0), 1, merged=0, seconds_left=None)
        return PassWorker(store, 1, slice_seconds).sample(plan, task, inf, time.process_time())

    assert isinstance(sampled(Tile(1, 0, 0, 32, 32), 0.0), Preempted)
    assert isinstance(sampled(Tile(1, 5, 7, 6, 8), 0.0), TileDone)
    assert isinstance(sampled(Tile(1, 0, 0, 32, 32), TIMEOUT), TileDone)


def glass() -> dict[str, Any]:
    """Balls of glass in one another: the coarse picture alone takes some 25 CPU seconds."""
    document = scene(256, 256, samples=1, light_samples=1)
    document["materials"]["ball"] = {"type": "phong", "color": [0, 0, 0], "transmission": 1, "max_depth": 64}
    document["shapes"] = [
        {"type": "ellipsoid", "center": [0, 0.5, 0], "radius": 2 - size / 8, "material": "ball"}
        for size in range(8)
    ]
    return document


def crowd() -> dict[str, Any]:
    """Balls in one place: any part of the picture takes 15 CPU seconds, and cannot be preempted."""
    document = scene(64, 64, samples=1, light_samples=1)
    document["shapes"] = [
        {"type": "ellipsoid", "center": [number / 1e6, 1, 0], "radius": 1, "material": "ball"}
        for number in range(20_000)
    ]
    return document


@pytest.mark.slow
@pytest.mark.parametrize("document", [glass(), crowd()], ids=["preempted", "overdue"])
def test_users_wait_for_no_tile_of_another(start: Start, tmp_path: Path, document: dict[str, Any]) -> None:
    keys = make_keys(tmp_path, ann=Role.SUBMIT, bob=Role.SUBMIT)
    url = start(max_cpu_seconds=1e9, max_queued_cpu_seconds=1e9, max_user_cpu_seconds=1e9).url
    with (
        httpx2.Client(base_url=url, timeout=TIMEOUT, headers=bearer(keys["ann"])) as ann,
        httpx2.Client(base_url=url, timeout=TIMEOUT, headers=bearer(keys["bob"])) as bob,
    ):
        jobs = [submit(ann, document) for _ in range(2)]
        until(lambda: all(job_of(ann, job)["state"] == "running" for job in jobs))
        finish(bob, submit(bob, scene(32, 32)))
        assert [job_of(ann, job)["progress"]["done"] for job in jobs] == [0, 0]
