"""Entry: in one transaction a job gets a render with all its steps, or shares an existing one.

All users wait for this transaction, so everything else is prepared before, and it makes few round trips.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import structlog
from sqlalchemy import Row, and_, bindparam, delete, insert, select, text
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.access.principals import Principal
from service.dispatch import adaptive_passes as adaptive
from service.jobs import damaged_files, uploads
from service.jobs.admission import Admitted
from service.jobs.context import Service
from service.jobs.limits import COUNTED, check_queue
from service.jobs.submission import Prepared, SubmittedJob, is_recent, replayed
from service.lifecycle import clock, fairness, progress, rows, sharing
from service.settings import Settings
from service.storage.database.models import SHAREABLE, Base, IdempotencyRow, JobRow, RenderRow, ShareRow

# Another request may enter the same key, or the same render, at the same time: each spoils one try.
MAX_TRIES = 3

# Built once: making a statement takes longer than executing it.
# The condition stands here as in the index of renders that may be joined, so that SQLite uses it.
_IS_SAME = and_(
    RenderRow.spec_sha256 == bindparam("sha256"), RenderRow.version == bindparam("version"), text(SHAREABLE)
)
_TILES, _REQUESTS, _LABELS, _KEYS = (
    insert(Base.metadata.tables[name]) for name in ("tiles", "requests", "labels", "idempotency_keys")
)
_KEY = Base.metadata.tables["idempotency_keys"].c
_FORGET_KEY = delete(Base.metadata.tables["idempotency_keys"]).where(
    _KEY.owner == bindparam("of"), _KEY.key == bindparam("forgotten")
)
_COUNTS = COUNTED.subquery()
_KNOWN = (
    select(_COUNTS, IdempotencyRow, RenderRow, ShareRow)
    .outerjoin_from(
        _COUNTS,
        IdempotencyRow,
        and_(IdempotencyRow.owner == bindparam("owner"), IdempotencyRow.key == bindparam("key")),
    )
    .outerjoin(RenderRow, _IS_SAME)
    .outerjoin(ShareRow, ShareRow.owner == bindparam("owner"))
)
"""The queue, an earlier request with the same key, a render of the same picture, and the user's share."""

log = structlog.get_logger()


def enter(service: Service, prepared: Prepared) -> SubmittedJob:
    """Enter a job, or return the job of an equal request with the same key.

    Raises
    ------
    ReusedKeyError
        If its key came with another request before.
    QueueFullError
        If it does not fit into the queue now.
    """
    for number in range(MAX_TRIES - 1):
        try:
            return _enter(service, prepared, force_new_render=number > 0)
        except (IntegrityError, _OvertakenError):
            log.debug("another request was faster")
    return _enter(service, prepared, force_new_render=True)


class _OvertakenError(Exception):
    """Another request has come with the key meanwhile, or the render to join has ended."""


@dataclass(frozen=True)
class _Entry:
    """Rows about to be entered.

    Attributes
    ----------
    render : RenderRow or None
        A render of its own, for which the store has what it needs.
    steps : list
        Those of the render.
    """

    prepared: Prepared
    job: JobRow
    render: RenderRow | None = None
    steps: Sequence[adaptive.Step] = ()


def _enter(service: Service, prepared: Prepared, *, force_new_render: bool) -> SubmittedJob:
    """Enter a job once.

    Parameters
    ----------
    force_new_render
        Whether to prepare for a render of its own in any case. Otherwise nothing is written to the store
        where there is a render to join, and if that has ended meanwhile, the job is not entered.
    """
    known = replayed(service, prepared) if prepared.sent.key is not None else None
    if known is not None:
        return known
    job = _job(prepared)
    entry = _Entry(prepared, job)
    if force_new_render or _needs_render(service, prepared, job):
        entry = _Entry(prepared, job, *_own_render(service, prepared, job.id))
    try:
        if entry.render:
            # Before the transaction, which would keep others waiting for the store. Workers look for it as
            # soon as that is over.
            service.store.put_spec(job.id, prepared.spec.content)
        with service.database.writing() as session:
            submitted = _enter_job(service, session, entry)
    except BaseException as error:
        # Where the connection was lost it is unknown whether the job was entered.
        if entry.render and not (isinstance(error, DBAPIError) and error.connection_invalidated):
            service.store.drop_job(job.id)
        raise
    if entry.render and submitted.render != job.id:
        service.store.drop_job(job.id)
    _announce(service, prepared.sent.principal, submitted)
    return submitted


def _announce(service: Service, principal: Principal, submitted: SubmittedJob) -> None:
    service.dispatcher.wake()
    service.spans.taken(submitted.job, submitted.render, shared=submitted.shared)
    names = {"job": submitted.job, "render": submitted.render, "shared": submitted.shared}
    log.info("job accepted", user=principal.name, **names)


def _needs_render(service: Service, prepared: Prepared, job: JobRow) -> bool:
    """Whether there is no render of the picture whose files are there.

    Raises
    ------
    QueueFullError
        If there is no room for another render: nothing is written to the store for it.
    """
    with service.database.reading() as session:
        known = _known(session, prepared)
    found = known.RenderRow
    if found is not None and (not found.state.final or damaged_files.has_files(service, found)):
        return False
    job.load = job.predicted_cpu_seconds
    rate = service.dispatcher.throughput.rate()
    check_queue(known, service.settings, prepared.sent.principal, job, rate)
    return True


def _known(session: Session, prepared: Prepared) -> Row[Any]:
    """Read everything that decides about a job in one statement, since others wait for it."""
    sent, spec = prepared.sent, prepared.spec
    names = {"owner": sent.principal.name, "key": sent.key, "sha256": spec.sha256, "version": spec.version}
    return session.execute(_KNOWN, names).one()


def _enter_job(service: Service, session: Session, entry: _Entry) -> SubmittedJob:
    prepared, job, own = entry.prepared, entry.job, entry.render
    sent, known = prepared.sent, _known(session, prepared)
    found = known.RenderRow
    if is_recent(known.IdempotencyRow) or (found is None and own is None):
        raise _OvertakenError
    if found is not None:
        _share(job, found)
    job.load = 0.0 if found else job.predicted_cpu_seconds
    rate = service.dispatcher.throughput.rate()
    queue = check_queue(known, service.settings, sent.principal, job, rate)
    job.render = found or own
    assert job.render is not None
    hashes = uploads.hashes_of(prepared.admitted.request.scene) if found is None else set()
    uploads.check_uses(session, hashes)
    if not job.state.final:
        job.coarse_cpu_seconds = fairness.coarse_cpu_seconds(job.render)
        fairness.activate(session, [job.owner])
    if found is not None and found.idle_since is not None:
        found.idle_since = job.finished_at
    session.add(job)
    session.flush()
    if found is not None:
        sharing.follow(session, found)
        session.flush()
    with service.database.pipelined(session):
        if found is None:
            steps = [rows.new_step(job.render.number, pass_, tile) for pass_, tile in entry.steps]
            session.execute(_TILES, steps)
            uploads.enter_uses(session, job.render.number, hashes)
        _enter_parts(session, prepared, job)
        service.database.notify(session, work=True)
    return SubmittedJob(job.id, replayed=False, render=job.render.id, shared=found is not None, queue=queue)


def _enter_parts(session: Session, prepared: Prepared, job: JobRow) -> None:
    sent = prepared.sent
    session.execute(_REQUESTS, {"job": job.number, "body": prepared.stored})
    if job.labels:
        labels = [
            {"job": job.number, "owner": job.owner, "name": name, "value": value}
            for name, value in job.labels.items()
        ]
        session.execute(_LABELS, labels)
    if sent.key is not None:
        # An expired one may still be there.
        session.execute(_FORGET_KEY, {"of": job.owner, "forgotten": sent.key})
        key = {"owner": job.owner, "key": sent.key, "body_sha256": sent.body_sha256}
        session.execute(_KEYS, key | {"job": job.number, "created_at": job.created_at})


def _job(prepared: Prepared) -> JobRow:
    admitted, request = prepared.admitted, prepared.admitted.request
    return JobRow(
        id=secrets.token_hex(8),
        owner=prepared.sent.principal.name,
        name=request.scene.name,
        labels=request.labels,
        priority=request.priority,
        # With target quality the limit is part of what is rendered.
        time_limit=request.time_limit if admitted.target is None else None,
        quality=request.asked_quality.model_dump(exclude_none=True),
        state=JobState.QUEUED,
        load=0.0,
        plan=admitted.description.model_dump(mode="json"),
        warnings=[warning.model_dump() for warning in admitted.warnings],
        predicted_cpu_seconds=admitted.description.cost.cpu_seconds,
        created_at=clock.now(),
    )


def _share(job: JobRow, render: RenderRow) -> None:
    """Let a job join a render. It has its own times, which reveal nothing of earlier jobs."""
    job.render, job.state = render, render.state
    if render.state is not JobState.QUEUED:
        job.started_at = job.created_at
    if render.state.final:
        job.finished_at = job.created_at


def _own_render(
    service: Service, prepared: Prepared, render_id: str
) -> tuple[RenderRow, Sequence[adaptive.Step]]:
    """Make a render, which is not entered yet, and its steps."""
    admitted, spec = prepared.admitted, prepared.spec
    plan, steps = admitted.outline, admitted.outline.steps
    render = RenderRow(
        id=render_id,
        width=plan.width,
        height=plan.height,
        spec_sha256=spec.sha256,
        version=spec.version,
        passes=[asdict(pass_) for pass_ in dict.fromkeys(pass_ for pass_, _ in steps)],
        display=admitted.request.scene.display.model_dump(),
        layers=list(admitted.request.layers),
        total_steps=len(steps),
        predicted_cpu_seconds=admitted.description.cost.cpu_seconds,
        numerics=plan.numerics,
        stored_bytes=len(spec.content),
        traceparent=service.spans.here(),
        **_course(admitted, service.settings),
    )
    return render, steps


def _course(admitted: Admitted, settings: Settings) -> dict[str, Any]:
    """The columns of a render's progress."""
    plan, target = admitted.outline, admitted.target
    if target is not None:
        return adaptive.begin(plan, target, settings.tile_size)
    return {
        "total_work": sum(rows.work(pass_, tile) for pass_, tile in plan.steps),
        "pass_costs": progress.begin_passes([pass_.index for pass_, _ in plan.steps]),
        "error_unknown": plan.error_unknown,
    }
