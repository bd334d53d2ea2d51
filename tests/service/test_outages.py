"""Time limits and outages: a job does not run while the service cannot work on it."""

import os
import signal
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import httpx2
import pytest

from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.processes import fork_servers_of, held, workers_of
from tests.service.sending import client_of
from tests.service.support import finish, submit, wait, work

pytestmark = pytest.mark.slow

# Ten times what both jobs need together.
LIMIT, ERROR = 10.0, 0.003
Outage = Callable[[RunningServer, Path], Iterator[None]]


def suspended(server: RunningServer, _: Path) -> Iterator[None]:
    """The machine sleeps: neither the server nor its workers run."""
    own = server.process.pid
    with held(own, *fork_servers_of(own), *workers_of(own)):
        yield


def without_workers(server: RunningServer, _: Path) -> Iterator[None]:
    workers = workers_of(server.process.pid)
    with held(*fork_servers_of(server.process.pid)):
        for worker in workers:
            os.kill(worker, signal.SIGKILL)
        yield


def without_database(_: RunningServer, data: Path) -> Iterator[None]:
    with closing(sqlite3.connect(data / "penumbra.sqlite")) as connection:
        connection.execute("PRAGMA busy_timeout = 10000")
        connection.execute("BEGIN IMMEDIATE")
        yield
        connection.rollback()


def both_qualities(client: httpx2.Client) -> tuple[str, str]:
    """Two jobs with the time limit that have begun."""
    fixed = submit(client, work(), time_limit=LIMIT)
    quality = {"mode": "target", "error": ERROR, "time_limit": LIMIT}
    target = submit(client, work(), quality=quality)
    for job in (fixed, target):
        wait(client, job, lambda found: found["last_seq"] > 0)
    return fixed, target


def check_both(client: httpx2.Client, fixed: str, target: str) -> None:
    """One is finished, and the other has reached its error: neither was short of time."""
    finish(client, fixed)
    assert finish(client, target)["error"]["estimate"] <= ERROR


@pytest.mark.parametrize(("kind", "kill"), [("postgresql", True), ("sqlite", False)])
def test_time_limit_does_not_count_a_restart(
    start: Start, request: pytest.FixtureRequest, kind: str, kill: bool
) -> None:
    url = request.getfixturevalue("postgres").database() if kind == "postgresql" else None
    first = start(workers=1, database=url)
    with client_of(first) as client:
        jobs = both_qualities(client)
    first.process.send_signal(signal.SIGKILL if kill else signal.SIGTERM)
    first.process.wait()
    time.sleep(LIMIT)
    with client_of(start(workers=1, database=url)) as client:
        check_both(client, *jobs)


@pytest.mark.parametrize("outage", [suspended, without_workers, without_database])
def test_time_limit_does_not_count_an_outage(start: Start, tmp_path: Path, outage: Outage) -> None:
    server = start(workers=1)
    with client_of(server) as client:
        jobs = both_qualities(client)
        with contextmanager(outage)(server, tmp_path):
            time.sleep(LIMIT)
        check_both(client, *jobs)
