"""What is read to show a page or to sweep does not grow with what is kept: by counts, never by time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Select, event, text

from benchmarks.lists import counted, fill
from schemas.api.jobs import JobState
from service.app import assemble
from service.dispatch.job_events import JobEvents
from service.jobs import lifecycle, retention
from service.jobs.context import Service
from service.jobs.retention import Rules
from service.lifecycle import fairness
from service.settings import Settings
from service.storage.database.connection import Database

QUEUED, FEW, MANY = 60, 150, 600
RULES = Rules(keep_seconds=86400.0, max_stored_bytes=2**40, keep_asset_seconds=86400.0)
Look = Callable[[Service], object]


def page(cursor: int | None = None, **chosen: Any) -> Look:
    wanted = {"owner": None, "state": None, "labels": {}} | chosen
    return lambda service: lifecycle.page(service, 3, cursor, **wanted)


LOOKS: Mapping[str, Look] = {
    "queued": page(),
    "finished": page(FEW),
    "in a state": page(state=JobState.SUCCEEDED),
    "in a rare state": page(state=JobState.FAILED),
    "of a user": page(owner="user 1"),
    "of a user in a rare state": page(owner="user 1", state=JobState.FAILED),
    "with a label": page(labels={"course": "rare"}),
    "of a user with a label": page(owner="user 1", labels={"course": "rare"}),
    "metrics": lambda service: service.dispatcher.metrics.text(service.database),
    "sweep": lambda service: service.retention_thread.prune(RULES),
}


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Service, Service]]:
    """Two with the same queue, the second of which keeps four times as many pictures. Nothing runs."""
    few, many = (filled(tmp_path_factory.mktemp("kept"), kept) for kept in (FEW, MANY))
    yield few, many
    for service in (few, many):
        service.database.close()


def filled(data: Path, kept: int) -> Service:
    async def begin() -> Service:
        return assemble(Settings(data=data, log_level="error"), JobEvents())

    service = asyncio.run(begin())
    fill(service, QUEUED, kept, users=5, rare=7)
    return service


def work(service: Service, look: Look) -> int:
    """Count the instructions that SQLite executes: the same for the same rows, on every machine."""
    look(service)
    instructions = 0

    def step() -> None:
        nonlocal instructions
        instructions += 1

    def watch(connection: Any, *_: object) -> None:
        connection.set_progress_handler(step, 1)

    event.listen(service.database.engine, "checkout", watch)
    look(service)
    event.remove(service.database.engine, "checkout", watch)
    return instructions


@pytest.mark.parametrize("look", LOOKS.values(), ids=LOOKS)
def test_four_times_as_many_pictures_take_no_more_work(services: tuple[Service, Service], look: Look) -> None:
    few, many = (work(service, look) for service in services)
    # Numbers and hashes of other lengths take some instructions more or less.
    assert 0 < many < 1.1 * few


def test_a_sweep_lists_no_files(services: tuple[Service, Service]) -> None:
    with counted(services[0]) as counts:
        services[0].retention_thread.prune(RULES)
    assert counts["files"] == 0
    assert counts["statements"] > 0


def plan(database: Database, statement: Select[Any]) -> str:
    """Say how a database executes a statement: on PostgreSQL without reading whole small tables."""
    compiled = statement.compile(database.engine, compile_kwargs={"literal_binds": True})
    with database.reading() as session:
        if database.shared:
            for way in ("seqscan", "bitmapscan"):
                session.execute(text(f"SET LOCAL enable_{way} = off"))
        words = "EXPLAIN" if database.shared else "EXPLAIN QUERY PLAN"
        return "\n".join(str(row) for row in session.execute(text(f"{words} {compiled}")))


STATEMENTS = {
    "ix_jobs_queue": fairness.QUEUE,
    "ix_renders_idle": retention.IDLE,
    "ix_renders_unmeasured": retention.WITHOUT_SIZE,
    "ix_jobs_with_picture": retention.EXPIRING.limit(5),
    "ix_jobs_finished_at": retention.FORGOTTEN.limit(5),
}


# PostgreSQL chooses that one by its statistics, of which an empty table has none.
BY_STATISTICS = "ix_renders_unmeasured"
PLANNED = [("sqlite", index) for index in STATEMENTS] + [
    ("postgresql", index) for index in STATEMENTS if index != BY_STATISTICS
]


@pytest.mark.parametrize(("database", "index"), PLANNED, indirect=["database"])
def test_a_statement_takes_its_rows_in_order_from_its_index(database: Database, index: str) -> None:
    found = plan(database, STATEMENTS[index])
    assert index in found
    assert not [word for word in ("TEMP B-TREE", "Sort") if word in found], found
