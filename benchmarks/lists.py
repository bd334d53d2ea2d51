"""What it costs to look at a full service: a page of jobs, one job, the metrics, and a sweep of retention."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypedDict

import httpx2
from sqlalchemy import (
    JSON,
    Integer,
    String,
    case,
    cast,
    delete,
    event,
    insert,
    literal,
    literal_column,
    select,
    true,
)

from benchmarks.capacity.workloads import request
from schemas.api.jobs import JobState
from service import logs
from service.access.principals import LOCAL
from service.app import assemble, create_app
from service.dispatch.job_events import JobEvents
from service.jobs.admission import admit
from service.jobs.submission import Submission, enter
from service.lifecycle import fairness, totals
from service.settings import Settings
from service.storage.database.columns import UtcDateTime
from service.storage.database.models import Base, JobRow, LabelRow, RenderRow, TileRow
from service.storage.folder import Folder

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator

    from sqlalchemy import CTE
    from sqlalchemy.orm import Session

    from service.jobs.context import Service
    from service.storage.objects import Found

QUEUED, KEPT = 10_000, 100_000
USERS = 100
RUNS = 9
RARE = 101
PICTURE_BYTES = 200
"""Far fewer than a picture has: only the number of files matters here."""
NUMERICS = {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 0}
LOOKS = {
    "a page of queued jobs": "/v1/jobs?limit=100",
    "a page of finished jobs": "/v1/jobs?limit=100&cursor={middle}",
    "a page of jobs in one state": "/v1/jobs?limit=100&state=succeeded",
    "a page of jobs with a rare label": "/v1/jobs?limit=100&label=course:rare",
    "a queued job": "/v1/jobs/{newest}",
    "the metrics": "/metrics",
}


class Look(TypedDict):
    """What one look costs: CPU milliseconds, the least of several, statements, and files listed."""

    cpu_ms: float
    statements: int
    files: int


class Lists(TypedDict):
    """How much there is, and what each look at it costs, by its name."""

    queued: int
    kept: int
    users: int
    looks: dict[str, Look]


def measure(queued: int = QUEUED, kept: int = KEPT) -> Lists:
    """Fill a service that hands out nothing, and look at it."""
    with TemporaryDirectory() as folder:
        # So many bytes that nothing is deleted, and few enough that they have to be counted.
        settings = Settings(data=Path(folder), log_level="error", max_stored_bytes=2**60)
        looks = asyncio.run(_looks(settings, queued, kept))
    return Lists(queued=queued, kept=kept, users=USERS, looks=looks)


async def _looks(settings: Settings, queued: int, kept: int) -> dict[str, Look]:
    logs.configure("error")
    app = create_app(settings)
    service = app.state.service = assemble(settings, JobEvents())
    fill(service, queued, kept)
    transport = httpx2.ASGITransport(app)
    async with httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        newest = (await client.get("/v1/jobs", params={"limit": 1})).json()["jobs"][0]["id"]
        addresses = {name: path.format(newest=newest, middle=kept // 2) for name, path in LOOKS.items()}
        found = {
            name: await _measured(service, partial(_get, client, path)) for name, path in addresses.items()
        }
    found["a sweep of retention"] = await _measured(service, partial(_sweep, service))
    service.database.close()
    return found


async def _get(client: httpx2.AsyncClient, path: str) -> None:
    (await client.get(path)).raise_for_status()


async def _sweep(service: Service) -> None:
    service.retention_thread.prune(service.retention_thread.rules)


async def _measured(service: Service, look: Callable[[], Awaitable[None]]) -> Look:
    await look()
    seconds = []
    with counted(service) as counts:
        for _ in range(RUNS):
            begun = time.process_time()
            await look()
            seconds.append(time.process_time() - begun)
    statements, files = (counts[name] // RUNS for name in ("statements", "files"))
    return Look(cpu_ms=round(1e3 * min(seconds), 1), statements=statements, files=files)


@contextmanager
def counted(service: Service) -> Iterator[Counter[str]]:
    """Count statements, and files of the data folder that are listed, until the block ends."""
    counts: Counter[str] = Counter()
    listed = Folder.found

    def note(*_: object) -> None:
        counts["statements"] += 1

    def found(folder: Folder, prefix: str = "") -> Iterator[Found]:
        for one in listed(folder, prefix):
            counts["files"] += 1
            yield one

    event.listen(service.database.engine, "before_cursor_execute", note)
    setattr(Folder, "found", found)  # noqa: B010  (a method, for a while)
    try:
        yield counts
    finally:
        setattr(Folder, "found", listed)  # noqa: B010
        event.remove(service.database.engine, "before_cursor_execute", note)


def fill(service: Service, queued: int, kept: int, users: int = USERS, rare: int = RARE) -> None:
    """Enter finished jobs with their pictures, and then queued ones: copies of one that was submitted.

    Parameters
    ----------
    rare
        One job in so many has another label than the rest.
    """
    admitted = admit(service, LOCAL, request())
    first = enter(service, Submission(LOCAL, request(), anew=True), admitted).job
    with service.database.writing() as session:
        job = session.scalars(select(JobRow.number).where(JobRow.id == first)).one()
        for begin, end, changes in (
            (job + 1, job + kept, _FINISHED),
            (job + kept + 1, job + kept + queued, _QUEUED),
        ):
            number = numbers(begin, end).c.number
            owner = literal("user ") + cast(number % users, String)
            label = case((number % rare == 0, "rare"), else_="usual")
            jobs = select(number, owner.label("owner"), label.label("label")).cte("jobs_to_make")
            _copy(session, job, jobs, changes)
        session.execute(delete(TileRow).where(TileRow.render == job))
        session.execute(delete(JobRow).where(JobRow.number == job))
        session.execute(delete(RenderRow).where(RenderRow.number == job))
        totals.add(session, totals.STORED_BYTES, kept * PICTURE_BYTES)
        fairness.activate(session, [f"user {number}" for number in range(users)])
    for done in range(job + 1, job + kept + 1):
        service.store.objects.begin(f"r{done}")
        service.store.put_file(f"r{done}", "image.npy", bytes(PICTURE_BYTES))


def numbers(first: int, last: int) -> CTE:
    """Make a table of the numbers from the first to the last."""
    counted = select(literal(first, Integer).label("number")).cte("numbers", recursive=True)
    return counted.union_all(select(counted.c.number + 1).where(counted.c.number < last))


_AT = literal(datetime(2026, 1, 2, tzinfo=UTC), UtcDateTime)
_STATE: dict[str, Any] = {"state": literal_column(f"'{JobState.SUCCEEDED}'")}
_FINISHED: dict[str, dict[str, Any]] = {
    "renders": _STATE
    | {"image_sha256": literal("0" * 64), "started_at": _AT, "idle_since": _AT}
    | {"numerics": literal(NUMERICS, JSON), "stored_bytes": literal(PICTURE_BYTES)},
    "jobs": _STATE | {"started_at": _AT, "finished_at": literal(datetime.now(UTC), UtcDateTime)},
}
"""Columns in which what is finished differs from what waits."""
_QUEUED: dict[str, dict[str, Any]] = {"renders": {}, "jobs": {}, "tiles": {}}


def _copy(session: Session, model: int, found: CTE, changes: dict[str, dict[str, Any]]) -> None:
    number = found.c.number
    text = cast(number, String)
    own: dict[str, dict[str, Any]] = {
        "renders": {"number": number, "id": literal("r") + text, "spec_sha256": text},
        "jobs": {
            "number": number,
            "id": literal("j") + text,
            "owner": found.c.owner,
            "render_number": number,
        },
        "tiles": {"render": number},
    }
    for name, changed in changes.items():
        table, values = Base.metadata.tables[name], changed | own[name]
        of = table.c.render if name == "tiles" else table.c.number
        columns = [values.get(column.name, column) for column in table.columns]
        rows = select(*columns).where(of == model).select_from(table.join(found, true()))
        session.execute(insert(table).from_select(list(table.columns), rows))
    labels = select(number, literal("course"), found.c.label, found.c.owner).select_from(found)
    session.execute(insert(LabelRow).from_select(["job", "name", "value", "owner"], labels))
