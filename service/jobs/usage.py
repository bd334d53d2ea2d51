"""Use of the service: open jobs, stored bytes and CPU seconds of each user, and the tasks of workers."""

from __future__ import annotations

import resource
from collections import defaultdict
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from schemas.api.administration import UserUse, WorkerInfo
from service.storage.database.models import (
    AssetOwnerRow,
    AssetRow,
    JobRow,
    KeyRow,
    RenderRow,
    ShareRow,
)
from service.workers.states import WorkerState
from service.workers.tasks import CallTask, JobTask


def page(session: Session, limit: int, after: str | None) -> list[UserUse]:
    """Return the users after the one with this name, at most ``limit``, in the order of their names."""
    names = _names(session, limit, after)
    open_jobs = _by_owner(session, names, JobRow.owner, func.count(), JobRow.finished_at.is_(None))
    charged = _by_owner(session, names, ShareRow.owner, func.sum(ShareRow.charged))
    used = _by_owner(session, names, KeyRow.user, func.max(KeyRow.last_used_at))
    pictures, files = _picture_bytes(session, names), _file_bytes(session, names)
    return [
        UserUse(
            user=name,
            open_jobs=open_jobs.get(name, 0),
            stored_bytes=pictures.get(name, 0) + files.get(name, 0),
            cpu_seconds=charged.get(name, 0.0),
            last_used_at=used.get(name),
        )
        for name in names
    ]


def _names(session: Session, limit: int, after: str | None) -> Sequence[str]:
    """Return the names of users who have a key, a job or a file, or were charged."""
    columns = KeyRow.user, JobRow.owner, ShareRow.owner, AssetOwnerRow.owner
    first, *others = (select(column.label("name")) for column in columns)
    every = first.union(*others).subquery()
    query = select(every.c.name).order_by(every.c.name).limit(limit)
    return session.scalars(query if after is None else query.where(every.c.name > after)).all()


def _by_owner(session: Session, names: Sequence[str], owner: Any, what: Any, *where: Any) -> dict[str, Any]:
    query = select(owner, what).where(owner.in_(names), *where).group_by(owner)
    return dict(session.execute(query).all())


def _picture_bytes(session: Session, names: Sequence[str]) -> dict[str, int]:
    # A user's jobs may share a render, whose bytes count once.
    seen = select(JobRow.owner, JobRow.render_number).where(JobRow.owner.in_(names)).distinct().subquery()
    query = select(seen.c.owner, func.sum(RenderRow.stored_bytes)).join(
        RenderRow, RenderRow.number == seen.c.render_number
    )
    return _summed(session, query.group_by(seen.c.owner))


def _file_bytes(session: Session, names: Sequence[str]) -> dict[str, int]:
    query = select(AssetOwnerRow.owner, func.sum(AssetRow.bytes)).join(
        AssetRow, AssetRow.sha256 == AssetOwnerRow.sha256
    )
    return _summed(session, query.where(AssetOwnerRow.owner.in_(names)).group_by(AssetOwnerRow.owner))


def _summed(session: Session, query: Select[str, int]) -> dict[str, int]:
    """Convert sums, which are decimals in PostgreSQL, and null for no rows."""
    return {owner: int(total or 0) for owner, total in session.execute(query)}


def at_work(session: Session, states: Collection[WorkerState]) -> tuple[WorkerInfo, ...]:
    """Describe workers, with the open jobs that their tasks are for."""
    renders = {state.task.job for state in states if isinstance(state.task, JobTask)}
    query = select(RenderRow.id, JobRow.id, JobRow.owner).join(
        RenderRow, JobRow.render_number == RenderRow.number
    )
    jobs: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for render, job, owner in session.execute(
        query.where(RenderRow.id.in_(renders), JobRow.finished_at.is_(None)).order_by(JobRow.number)
    ):
        jobs[render].append((job, owner))
    return tuple(_worker(state, jobs) for state in states)


def _worker(state: WorkerState, jobs: dict[str, list[tuple[str, str]]]) -> WorkerInfo:
    task = state.task
    sharing = jobs[task.job] if isinstance(task, JobTask) else []
    users = [task.user] if isinstance(task, CallTask) else dict.fromkeys(owner for _, owner in sharing)
    return WorkerInfo(
        name=state.name,
        pid=state.pid,
        memory_bytes=_memory(state.pid) if state.pid else None,
        task=type(task).__name__.removesuffix("Task").lower() if task else None,
        jobs=tuple(job for job, _ in sharing),
        users=tuple(users),
        seconds=state.seconds,
    )


def _memory(pid: int) -> int | None:
    """Return the resident bytes of a process, where the system reports them and it still runs."""
    with suppress(OSError):
        pages = Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]
        return int(pages) * resource.getpagesize()
    return None
