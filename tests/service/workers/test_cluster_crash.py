"""A Dask cluster of separate processes, each of which is killed in the middle of a job."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import psutil
import pytest
from distributed import Client
from prometheus_client.parser import text_string_to_metric_families

import renderer
from service.settings import Settings
from service.workers.dask_engine import TASKS_PER_WORKER
from service.workers.dask_worker import execute
from service.workers.tasks import Interrupted
from tests.service.dask_cluster import Cluster
from tests.service.forking import running
from tests.service.support import TIMEOUT, finish, image, scene, steps, submit, until, wait

pytestmark = pytest.mark.slow

DOCUMENT = scene(192, 192, samples=16, light_samples=64)

Steps = dict[tuple[int, int], dict[str, Any]]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    started = Cluster()
    started.start_worker()
    started.start_worker()
    yield started
    started.close()


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return renderer.render(renderer.compile_scene(DOCUMENT), workers=2).image


class Service:
    """A server that uses the cluster, and may be started again on the same folder."""

    def __init__(self, data: Path, cluster: Cluster) -> None:
        self._settings = Settings(
            data=data, port=0, tile_size=48, log_level="error", engine="dask", dask=cluster.address
        )
        self._stack = ExitStack()
        self.start()

    def start(self) -> None:
        self.server = self._stack.enter_context(running(self._settings))
        self.client = self._stack.enter_context(httpx2.Client(base_url=self.server.url, timeout=TIMEOUT))

    def half_done(self) -> str:
        """A job of which some tiles are finished and others run."""
        job = submit(self.client, DOCUMENT)
        wait(self.client, job, lambda found: found["progress"]["done"] >= 3)
        return job

    def tiles(self, job: str) -> Steps:
        return steps(self._settings.data, job)

    def finished(self, job: str) -> Steps:
        found = {key: row for key, row in self.tiles(job).items() if row["state"] == "done"}
        assert len(found) >= 3
        return found

    def check(self, job: str, expected: np.ndarray, finished: Steps) -> Steps:
        """Wait for the picture: what was finished was not rendered again."""
        finish(self.client, job)
        assert image(self.client, job).tobytes() == expected.tobytes()
        after = self.tiles(job)
        assert {key: after[key] for key in finished} == finished
        return after

    def close(self) -> None:
        self._stack.close()


@pytest.fixture(scope="module")
def service(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    started = Service(tmp_path_factory.mktemp("service"), cluster)
    yield started
    started.close()


def test_worker_without_a_slot_gives_its_task_back(cluster: Cluster) -> None:
    with Client(cluster.address, set_as_default=False) as client:
        assert client.submit(execute, "key", None, pure=False).result(TIMEOUT) == Interrupted()


def test_what_is_lost_with_a_worker_is_rendered_by_another(
    cluster: Cluster, service: Service, undisturbed: np.ndarray
) -> None:
    cluster.wait_for_workers()
    # Sixteen tiles: after a few each worker runs one, and another waits there.
    job = service.half_done()
    lost = cluster.workers.pop()
    slots = psutil.Process(lost.pid).children()
    lost.kill()
    lost.wait()
    until(lambda: not any(map(_runs, slots)))
    tiles = service.check(job, undisturbed, {}).values()
    # Only the running task counts; those that waited behind it do not.
    assert sum(row["deaths"] for row in tiles) <= 1
    assert 1 <= sum(row["attempt"] > 1 for row in tiles) <= TASKS_PER_WORKER
    cluster.start_worker()


def _runs(process: psutil.Process) -> bool:
    return process.is_running() and process.status() != psutil.STATUS_ZOMBIE


def test_job_continues_when_the_scheduler_is_back(
    cluster: Cluster, service: Service, undisturbed: np.ndarray
) -> None:
    cluster.wait_for_workers()
    job = service.half_done()
    os.kill(cluster.scheduler.pid, signal.SIGKILL)
    for process in (cluster.scheduler, *cluster.workers):
        process.wait(TIMEOUT)
    until(lambda: service.client.get("/readyz").status_code == 503)
    finished = service.finished(job)
    cluster.restart()
    cluster.wait_for_workers()
    after = service.check(job, undisturbed, finished)
    assert not any(row["deaths"] for row in after.values())


def test_killed_server_finds_the_cluster_again(service: Service, undisturbed: np.ndarray) -> None:
    job = service.half_done()
    service.server.process.kill()
    service.server.process.wait()
    finished = service.finished(job)
    service.start()
    service.check(job, undisturbed, finished)


@pytest.fixture
def fast_clock() -> Iterator[Cluster]:
    """A cluster whose only worker is on a machine that is an hour fast; elapsed time is what it is there."""
    library = next(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"), None)
    if library is None:
        pytest.skip("no libfaketime on this machine: apt-get install faketime")
    started = Cluster()
    clock = {"FAKETIME": "+1h", "FAKETIME_DONT_FAKE_MONOTONIC": "1"}
    started.start_worker(LD_PRELOAD=str(library), **clock)
    yield started
    started.close()


def test_worker_an_hour_fast_renders_within_a_time_limit(fast_clock: Cluster, tmp_path: Path) -> None:
    settings = Settings(
        data=tmp_path, port=0, tile_size=32, log_level="error", engine="dask", dask=fast_clock.address
    )
    # A picture of about a second: the limit ends it only where no tile is rendered.
    quality = {"mode": "target", "error": 0.005, "time_limit": TIMEOUT}
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        fast_clock.wait_for_workers()
        found = finish(client, submit(client, scene(), quality=quality))
        families = text_string_to_metric_families(client.get("/metrics").text)
    samples = (sample for family in families for sample in family.samples)
    assert found["error"]["estimate"] <= 0.005
    assert [found.value for found in samples if found.name == "penumbra_late_tiles_total"] == [0]
    assert {row["attempt"] for row in steps(tmp_path).values() if row["tile"]} == {1}
