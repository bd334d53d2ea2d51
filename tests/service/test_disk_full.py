"""A full disk, and one that is read-only for a while: the server has a file system of its own."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

import httpx2
import numpy as np
import pytest
from sqlalchemy import select, update
from sqlalchemy.exc import OperationalError

from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.database.models import LeaderRow
from tests.service.failover import half_done
from tests.service.forking import running
from tests.service.support import TIMEOUT, ended, finish, image, job_of, scene, submit, until
from tests.service.test_deployments import port

pytestmark = pytest.mark.slow

SIZE, PAGE = 64 << 20, 4096
# Ten times what the job needs.
LIMIT = 10.0
AT_ONCE = 4


@contextmanager
def mounted() -> Iterator[Path]:
    """A small file system of its own."""
    # Not in a folder of pytest's own: another run that cleans up there must not find what it cannot remove.
    with TemporaryDirectory() as folder:
        reported = mount("-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", folder)
        if reported is not None:
            pytest.skip(f"no file system can be mounted here, which needs root: {reported}")
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", "--lazy", folder], check=True)


@pytest.fixture(scope="module")
def disk() -> Iterator[Path]:
    with mounted() as folder:
        yield folder


def mount(*words: str) -> str | None:
    """Mount something, or say why that is not possible."""
    if shutil.which("mount") is None:
        return "there is no program mount"
    tried = subprocess.run(["mount", *words], check=False, capture_output=True, text=True)
    return tried.stderr.strip() if tried.returncode else None


@pytest.fixture(scope="module")
def client(disk: Path) -> Iterator[httpx2.Client]:
    settings = Settings(data=disk, port=0, workers=1, tile_size=48, min_free_bytes=1 << 20, log_level="error")
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as opened:
        yield opened


@contextmanager
def full(disk: Path) -> Iterator[Callable[[], None]]:
    """Leave no room on a disk; what is given fills it again, for those who failed have left theirs."""
    ballast = disk / "ballast"

    def fill() -> None:
        with suppress(OSError), ballast.open("ab", buffering=0) as file:
            while file.write(bytes(PAGE)):
                pass

    fill()
    try:
        yield fill
    finally:
        ballast.unlink()


@contextmanager
def read_only(disk: Path) -> Iterator[None]:
    """Refuse writes to files that are not open yet, as the database is."""
    assert mount("--bind", "-o", "ro", str(disk), str(disk)) is None
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True)


def check_reads(client: httpx2.Client, finished: str, running: str) -> None:
    """Existing pictures are reported and shown, finished or not."""
    for kind in ("png", "exr"):
        assert client.get(f"/v1/jobs/{finished}/image.{kind}").status_code == 200
    assert image(client, running).shape == (192, 192, 3)
    assert len(client.get(f"/v1/jobs/{running}/tiles").json()["events"]) >= 3
    assert not ended(job_of(client, running))


def refusals(client: httpx2.Client) -> set[tuple[int, str]]:
    """Answers to several submissions at once."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        answers = list(pool.map(lambda _: client.post("/v1/jobs", json={"scene": scene()}), range(AT_ONCE)))
    assert all(int(answer.headers["Retry-After"]) > 0 for answer in answers)
    assert {answer.headers["Content-Type"] for answer in answers} == {"application/problem+json"}
    return {(answer.status_code, answer.json()["code"]) for answer in answers}


@pytest.mark.parametrize("fault", ["full", "read_only"])
def test_jobs_wait_and_readers_do_not(
    disk: Path, client: httpx2.Client, undisturbed: np.ndarray, fault: str
) -> None:
    finished = submit(client, scene())
    finish(client, finished)
    job = half_done(client, time_limit=LIMIT)
    if fault == "full":
        with full(disk) as fill:
            # Either a worker or the database may report it first.
            until(lambda: client.get("/readyz").status_code == 503)
            fill()
            check_reads(client, finished, job)
            assert refusals(client) == {(507, "store_full")}
            # The disk is full for longer than the job may run.
            time.sleep(LIMIT)
            assert client.get("/readyz").status_code == 503
    else:
        with read_only(disk):
            metric = 'penumbra_task_failures_total{code="storage_read_only"}'
            until(lambda: metric in client.get("/metrics").text)
            check_reads(client, finished, job)
            assert refusals(client) == {(503, "store_read_only")}
            time.sleep(LIMIT)
            assert client.get("/readyz").status_code == 503
    finish(client, job)
    assert image(client, job).tobytes() == undisturbed.tobytes()


def test_full_disk_is_cured_by_deleting_jobs(disk: Path, client: httpx2.Client) -> None:
    finished = [submit(client, scene(width, 48)) for width in range(80, 86)]
    for job in finished:
        finish(client, job)
    running = half_done(client)
    with full(disk) as fill:
        for job in [*finished[:4], running]:
            fill()
            assert client.delete(f"/v1/jobs/{job}").status_code == 204
            assert client.get(f"/v1/jobs/{job}").status_code == 404
        fill()
        pruned = client.post("/v1/prune", json={"max_stored_bytes": 0, "dry_run": False})
        assert (pruned.status_code, set(finished[4:]) <= set(pruned.json()["expired"])) == (200, True)
        assert not [path for job in finished for path in (disk / "jobs" / job).rglob("*")]
    finish(client, submit(client, scene()))


def test_service_that_has_stopped_starts_on_a_full_disk(tmp_path: Path) -> None:
    """SQLite removes its log at the end, and needs room for another one."""
    with mounted() as disk, (tmp_path / "log").open("wb") as log:
        settings = Settings(data=disk, port=0, workers=1, min_free_bytes=1 << 20, log_level="error")
        with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            jobs = [submit(client, scene(width, 48)) for width in (80, 81)]
            for job in jobs:
                finish(client, job)
        for job in jobs:
            with full(disk), begun(disk, log) as url, httpx2.Client(base_url=url, timeout=TIMEOUT) as client:
                assert "disk" in client.get("/readyz").json()["detail"]
                assert client.get(f"/v1/jobs/{job}/image.png").status_code == 200
                assert client.delete(f"/v1/jobs/{job}").status_code == 204
                assert not (disk / "jobs" / job).exists()
        assert (tmp_path / "log").read_text().count("disk nearly full") == len(jobs)


@contextmanager
def begun(data: Path, log: IO[bytes]) -> Iterator[str]:
    """Start a service that need not become ready; it is ended as by systemd."""
    number = port()
    given = {"PENUMBRA_DATA": str(data), "PENUMBRA_PORT": str(number), "PENUMBRA_WORKERS": "1"}
    process = subprocess.Popen([sys.executable, "-m", "service"], env=os.environ | given, stderr=log)
    url = f"http://127.0.0.1:{number}"
    try:
        until(lambda: process.poll() is not None or lives(url))
        assert process.poll() is None
        yield url
    finally:
        process.terminate()
        process.wait(TIMEOUT)


def lives(url: str) -> bool:
    try:
        return httpx2.get(f"{url}/livez", timeout=TIMEOUT).status_code == 200
    except httpx2.TransportError:
        return False


def test_connection_made_while_read_only_does_not_stay(disk: Path) -> None:
    database = Database(f"sqlite:///{disk / 'own.sqlite'}")

    def count_up() -> None:
        with database.writing() as session:
            session.execute(update(LeaderRow).values(term=LeaderRow.term + 1))

    upgrade(database)
    with read_only(disk), database.reading() as reader:
        # This one keeps the existing connection, so the next gets a new one.
        assert reader.scalars(select(LeaderRow.term)).all()
        with pytest.raises(OperationalError):
            count_up()
    for _ in range(3):
        count_up()
    database.close()
