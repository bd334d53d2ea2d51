"""Servers that are killed or stopped in the middle of a job, and started again."""

import re
import socket
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from sqlalchemy import select

from service.settings import Settings
from service.start_errors import PortTakenError
from service.storage.database.connection import Database
from service.storage.database.models import DONE, TileRow
from tests.service.conftest import Start
from tests.service.forking import running
from tests.service.processes import is_alive, workers_of
from tests.service.support import TIMEOUT, finish, image, job_of, long_scene, submit, until, wait, work


def finished(settings: Settings) -> dict[tuple[int, int], tuple[Any, ...]]:
    """The finished steps, each with its number, attempt, time and checksum."""
    database = Database(settings.database_url)
    with database.reading() as session:
        columns = TileRow.seq, TileRow.attempt, TileRow.cpu_seconds, TileRow.crc32
        query = select(TileRow.pass_index, TileRow.tile, *columns).where(TileRow.state == DONE)
        found = {tuple(row[:2]): tuple(row[2:]) for row in session.execute(query)}
    database.close()
    return found  # type: ignore[return-value]


@pytest.mark.parametrize("kind", ["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def test_no_finished_tile_is_rendered_again(
    kind: str, start: Start, tmp_path: Path, request: pytest.FixtureRequest, undisturbed: np.ndarray
) -> None:
    url = request.getfixturevalue("postgres").database() if kind == "postgresql" else None
    first = start(tile_size=48, database=url)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, work())
        wait(client, job, lambda found: found["progress"]["done"] >= 6)
    workers = workers_of(first.process.pid)
    first.process.kill()
    first.process.wait()
    until(lambda: not any(map(is_alive, workers)))
    settings = Settings(data=tmp_path, database=url)
    before = finished(settings)
    assert len(before) >= 6
    # What a killed server has left half written; beside PostgreSQL it may be another server's.
    litter = [tmp_path / "assets" / ".abc.tmp", tmp_path / "jobs" / "unknown" / "tiles" / "1-1.1"]
    litter = litter if kind == "sqlite" else []
    for path in litter:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"half")

    with httpx2.Client(base_url=start(tile_size=48, database=url).url, timeout=TIMEOUT) as client:
        assert not any(path.exists() for path in litter)
        events = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        assert [event["seq"] for event in events[: len(before)]] == list(range(1, len(before) + 1))
        finish(client, job)
        assert image(client, job).tobytes() == undisturbed.tobytes()
    after = finished(settings)
    assert {key: after[key] for key in before} == before
    assert sorted(row[0] for row in after.values()) == list(range(1, len(after) + 1))


@pytest.mark.slow
def test_stopped_server_sends_its_watchers_away(start: Start) -> None:
    first = start(workers=1)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, long_scene())
        wait(client, job, lambda found: found["last_seq"] > 0)
        with client.stream("GET", f"/v1/jobs/{job}/events") as answer:
            lines = answer.iter_lines()
            next(lines)
            first.process.terminate()
            assert not any(line == "event: end" for line in lines)
    assert first.process.wait(timeout=10) is not None
    with httpx2.Client(base_url=start(workers=2).url, timeout=TIMEOUT) as client:
        assert job_of(client, job)["state"] in {"running", "queued", "succeeded"}
        # The tasks of its workers are reported as retried.
        retries = r'^penumbra_retries_total\{cause="server_lost"\} [1-9]'
        assert re.search(retries, client.get("/metrics").text, re.MULTILINE)
        finish(client, job)


def test_server_on_a_port_that_is_taken_does_not_start(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        settings = Settings(data=tmp_path, port=taken.getsockname()[1], workers=1)
        with pytest.raises(PortTakenError), running(settings):
            pass
