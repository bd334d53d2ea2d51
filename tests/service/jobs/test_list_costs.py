"""Reads for a page of jobs or a sweep do not grow with the number of rows: by counts, never by time."""

import asyncio
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event, insert

from schemas.api.jobs import JobState
from schemas.tiles import Pass
from service.app import assemble
from service.dispatch.job_events import JobEvents
from service.jobs import listing
from service.jobs.context import Service
from service.jobs.sweep import Rules
from service.lifecycle import fairness, totals
from service.settings import Settings
from service.storage.database.models import JobRow, LabelRow, RenderRow
from tests.service.support import job_with

QUEUED, FEW, MANY = 60, 150, 600
BYTES = 200
RULES = Rules(keep_seconds=86400.0, max_stored_bytes=2**40, keep_asset_seconds=86400.0)
Look = Callable[[Service], object]


def page(**chosen: Any) -> Look:
    return lambda service: listing.page(service, listing.Listing(**chosen), 3, None)


LOOKS: Mapping[str, Look] = {
    "queued": page(),
    "in a rare state": page(state=JobState.FAILED),
    "of a user in a rare state": page(owner="user 1", state=JobState.FAILED),
    "with a label": page(labels={"course": ["rare"]}),
    "of a user with a label": page(owner="user 1", labels={"course": ["rare"]}),
    "with one of two labels": page(labels={"course": ["rare", "usual"]}),
    "metrics": lambda service: service.dispatcher.metrics.text(service.database),
    "sweep": lambda service: service.retention_thread.prune(RULES),
}


def filled(data: Path, kept: int) -> Service:
    """A service that hands out nothing, with finished jobs and then queued ones of five users."""

    async def begin() -> Service:
        return assemble(Settings(data=data, log_level="error"), JobEvents())

    service, now = asyncio.run(begin()), datetime.now(UTC)
    ended = {"state": JobState.SUCCEEDED, "started_at": now}
    numerics = {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 0}
    with service.database.writing() as session:
        for number in range(kept + QUEUED):
            is_kept = number < kept
            of_render = {"image_sha256": "0" * 64, "idle_since": now, "numerics": numerics, **ended}
            render = RenderRow(
                id=f"r{number}",
                width=16,
                height=12,
                spec_sha256=str(number),
                passes=[asdict(Pass(0, 4, 0, 1))],
                display={},
                total_steps=1,
                total_work=1,
                predicted_cpu_seconds=1.0,
                stored_bytes=BYTES,
                **(of_render if is_kept else {}),
            )
            label = "rare" if number % 7 == 0 else "usual"
            job = job_with(
                f"j{number}",
                render,
                owner=f"user {number % 5}",
                labels={"course": label},
                **(ended | {"finished_at": now} if is_kept else {}),
            )
            session.add(job)
            session.flush()
            session.add(LabelRow(job=job.number, name="course", value=label, owner=job.owner))
            if is_kept:
                service.store.objects.begin(render.id)
                service.store.put_file(render.id, "image.npy", bytes(BYTES))
        totals.add(session, totals.STORED_BYTES, kept * BYTES)
        fairness.activate(session, [f"user {number}" for number in range(5)])
    return service


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Service, Service]]:
    """Two with the same queue, the second of which keeps four times as many pictures. Nothing runs."""
    few, many = (filled(tmp_path_factory.mktemp("kept"), kept) for kept in (FEW, MANY))
    yield few, many
    for service in (few, many):
        service.database.close()


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


def test_the_newest_ten_thousand_are_searched_sorted_and_counted(tmp_path: Path) -> None:
    service, now = filled(tmp_path, 0), datetime.now(UTC)
    fields = {"owner": "many", "state": JobState.CANCELLED, "created_at": now, "finished_at": now}
    empty = {"labels": {}, "quality": {}, "plan": {}, "warnings": [], "predicted_cpu_seconds": 0.0}
    with service.database.writing() as session:
        many = [{"id": f"m{number}", "name": f"job {number}."} for number in range(10_002)]
        session.execute(insert(JobRow), [fields | empty | job for job in many])

    def found(**wanted: Any) -> tuple[list[str | None], int | None]:
        answer = listing.page(service, listing.Listing(**wanted), 1, None, total=True)
        return [job.id for job in answer.jobs], answer.total

    assert found(owner="many") == (["m10001"], 10_000)
    assert found(owner="many", sort="created") == (["m2"], 10_000)
    assert found(owner="many", search="job 2.") == (["m2"], 1)
    assert found(owner="many", search="job 1.") == ([], 0)
    assert found(owner="user 1", search=":rare") == (["j56"], 2)
    service.database.close()


@pytest.mark.parametrize("look", LOOKS.values(), ids=LOOKS)
def test_work_does_not_grow_with_what_is_kept(services: tuple[Service, Service], look: Look) -> None:
    few, many = (work(service, look) for service in services)
    # Numbers and hashes of other lengths take some instructions more or less.
    assert 0 < many < 1.1 * few
