"""Workers on machines whose clocks are wrong; libfaketime shifts the clock of a process and its children."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
from prometheus_client.parser import text_string_to_metric_families

from schemas.tiles import Tile
from service.dispatch.holding import HOLD_SECONDS, HeldTasks
from service.server import running
from service.settings import Settings
from service.telemetry.metrics import Metrics
from service.workers.tasks import Interrupted, SampleTask, after, pass_of
from tests.service.dask_cluster import Cluster
from tests.service.support import TIMEOUT, finish, scene, steps, submit


def task(seconds_left: float | None = 10.0) -> SampleTask:
    return SampleTask(
        "a", "", Tile(1, 0, 0, 8, 8), pass_of(1), attempt=1, merged=1, seconds_left=seconds_left
    )


def test_time_that_a_task_has_waited_is_taken_from_what_is_left() -> None:
    waited = after(task(), 4.0)
    assert isinstance(waited, SampleTask)
    assert waited.seconds_left == 6.0
    without = task(None)
    assert after(without, 4.0) is without


def test_a_held_task_is_released_when_its_time_has_passed_and_not_before() -> None:
    now = 100.0
    held = HeldTasks(lambda: now)
    first, second = task(), task()
    held.hold(first)
    now += HOLD_SECONDS / 2
    held.hold(second)
    assert list(held.release()) == []
    now += HOLD_SECONDS / 2
    assert list(held.release()) == [first]
    assert held.seconds_left() == HOLD_SECONDS / 2
    assert held.forget() == {second}
    assert held.seconds_left() is None


def test_late_tiles_are_counted() -> None:
    metrics = Metrics()
    metrics.note(task(), Interrupted(late=True))
    metrics.note(task(), Interrupted())
    assert metrics.registry.get_sample_value("penumbra_late_tiles_total") == 1


@pytest.fixture
def library() -> Path:
    """What shifts the clock of a process, and of all that it starts."""
    found = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
    if found is None:
        pytest.skip("no libfaketime on this machine: apt-get install faketime")
    return found


@pytest.fixture
def cluster(library: Path) -> Iterator[Cluster]:
    """A cluster whose only worker is on a machine that is an hour fast."""
    started = Cluster()
    # Elapsed time is what it is there, too.
    clock = {"FAKETIME": "+1h", "FAKETIME_DONT_FAKE_MONOTONIC": "1"}
    started.start_worker(LD_PRELOAD=str(library), **clock)
    yield started
    started.close()


@pytest.mark.slow
def test_a_worker_that_is_an_hour_fast_renders_what_has_a_time_limit(
    cluster: Cluster, tmp_path: Path
) -> None:
    settings = Settings(
        data=tmp_path, port=0, tile_size=32, log_level="error", engine="dask", dask=cluster.address
    )
    # A picture of about a second: the limit ends it only where no tile is rendered.
    quality = {"mode": "target", "error": 0.005, "time_limit": TIMEOUT}
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        cluster.wait_for_workers()
        found = finish(client, submit(client, scene(), quality=quality))
        metrics = client.get("/metrics").text
    assert found["error"]["estimate"] <= 0.005
    late = [
        sample.value
        for family in text_string_to_metric_families(metrics)
        for sample in family.samples
        if sample.name == "penumbra_late_tiles_total"
    ]
    assert late == [0]
    assert {row["attempt"] for row in steps(tmp_path).values() if row["tile"]} == {1}
