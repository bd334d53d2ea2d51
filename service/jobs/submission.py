"""Submission: in one transaction a job gets a render with all its steps, or shares an existing one."""

from __future__ import annotations

import hashlib
import json
import secrets
import zlib
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any

import structlog
from sqlalchemy import bindparam, insert, select, text
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.orm import Session

from renderer import progressive, tiling
from schemas.api.jobs import JobState
from service.access.principals import Principal
from service.dispatch import adaptive_passes as targets
from service.errors import ReusedKeyError
from service.jobs import canonical, damaged_files, uploads
from service.jobs.admission import Admitted, admit
from service.jobs.canonical import Spec
from service.jobs.context import Service
from service.jobs.limits import Queue, check_queue
from service.jobs.retention import KEY_LIFE
from service.lifecycle import clock, fairness, progress, rows, sharing
from service.settings import Settings
from service.storage.database.models import JOINED, Base, IdempotencyRow, JobRow, RenderRow, RequestRow

# Another request may enter the same key, or the same render, at the same time: each spoils one try.
TRIES = 3

# Built once: making a statement takes longer than executing it.
# The condition stands here as in the index of renders that may be joined, so that SQLite uses it.
_SAME = select(RenderRow.number).where(
    RenderRow.spec_sha256 == bindparam("sha256"), RenderRow.version == bindparam("version"), text(JOINED)
)
_TILES, _REQUESTS, _LABELS = (
    insert(table) for table in map(Base.metadata.tables.__getitem__, ("tiles", "requests", "labels"))
)

log = structlog.get_logger()


@dataclass(frozen=True)
class Submission:
    """A request for a job, as it was sent.

    Attributes
    ----------
    key : str or None
        Its ``Idempotency-Key``.
    anew : bool
        Whether to render it even if there is a stored picture.
    """

    principal: Principal
    body: bytes
    key: str | None = None
    anew: bool = False

    @property
    def body_sha256(self) -> str:
        """Digest that identifies equal requests."""
        return hashlib.sha256(self.body).hexdigest()


@dataclass(frozen=True)
class SubmittedJob:
    """A job that was taken, now or when the same request came before; how full the queue is with it.

    ``render`` names the render that it has, by the job which that was made for; ``shared`` says that the
    picture is there, or was being made.
    """

    job: str
    replayed: bool
    render: str | None = None
    shared: bool = False
    queue: Queue | None = None


def submit(service: Service, sent: Submission) -> SubmittedJob:
    """Keep a job.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used.
    ReusedKeyError
        If its key came with another request before.
    QueueFullError
        If it does not fit into the queue now.
    """
    if sent.key is not None:
        with service.database.reading() as session:
            before = _sent_before(session, sent)
            if before is not None and before.body_sha256 == sent.body_sha256:
                return SubmittedJob(_job_of(session, before), replayed=True)
    admitted = admit(service, sent.principal, sent.body)
    for number in range(TRIES - 1):
        try:
            return enter(service, sent, admitted, alone=number > 0)
        except IntegrityError:
            log.debug("entered by another request at the same time")
        except _RenderEndedError:
            log.debug("the render to join has ended without a picture meanwhile")
    return enter(service, sent, admitted, alone=True)


def _sent_before(session: Session, sent: Submission) -> IdempotencyRow | None:
    """Find an earlier request with the same key, unless it is too old."""
    if sent.key is None:
        return None
    row = session.get(IdempotencyRow, (sent.principal.name, sent.key))
    return None if row is None or row.created_at < datetime.now(UTC) - KEY_LIFE else row


def _job_of(session: Session, before: IdempotencyRow) -> str:
    return session.scalars(select(JobRow.id).where(JobRow.number == before.job)).one()


def _replayed(session: Session, sent: Submission) -> str | None:
    """Return the job of an earlier equal request with the same key."""
    before = _sent_before(session, sent)
    if before is None:
        return None
    if before.body_sha256 != sent.body_sha256 and not _is_same_document(session, before, sent.body):
        assert sent.key is not None
        raise ReusedKeyError(sent.key)
    return _job_of(session, before)


def _is_same_document(session: Session, before: IdempotencyRow, body: bytes) -> bool:
    """Whether two bodies differ only in how JSON is written: blanks, the order of members, 32.0 for 32."""
    kept = session.get_one(RequestRow, before.job).body
    # Booleans equal numbers in Python, but no field of an admitted request takes both.
    return bool(json.loads(zlib.decompress(kept)) == json.loads(body))


class _RenderEndedError(Exception):
    """There was a render to join, and there is none any more."""


@dataclass(frozen=True)
class _Entry:
    """What is about to be entered.

    Attributes
    ----------
    spec : Spec
        What is rendered, and identifies equal pictures.
    kept : bool
        Whether the store has what a render of its own needs.
    """

    sent: Submission
    admitted: Admitted
    job: JobRow
    spec: Spec
    kept: bool


def enter(service: Service, sent: Submission, admitted: Admitted, *, alone: bool = True) -> SubmittedJob:
    """Enter an admitted job, or return the earlier job of an equal request.

    Parameters
    ----------
    alone
        Whether to prepare for a render of its own in any case. Otherwise nothing is written to the store
        where there is a render to join, and if that has ended meanwhile, the job is not entered.
    """
    job = _job(sent.principal, admitted)
    spec = canonical.private_spec(sent.body) if sent.anew else canonical.spec_of(admitted.request)
    entry = _Entry(sent, admitted, job, spec, kept=alone or _needs_render(service, sent, job, spec))
    try:
        if entry.kept:
            # Before the transaction, which would keep others waiting for the store. Workers look for it as
            # soon as that is over.
            service.store.put_spec(job.id, spec.content)
        with service.database.writing() as session:
            known = _replayed(session, sent)
            submitted = SubmittedJob(known, replayed=True) if known else _enter_job(service, session, entry)
            service.database.notify(session, work=True)
    except BaseException as error:
        # Where the connection was lost it is unknown whether the job was entered.
        if entry.kept and not (isinstance(error, DBAPIError) and error.connection_invalidated):
            service.store.drop_job(job.id)
        raise
    if entry.kept and submitted.render != job.id:
        service.store.drop_job(job.id)
    service.dispatcher.wake()
    service.spans.taken(submitted.job, submitted.render, shared=submitted.shared)
    log.info(
        "job taken",
        job=submitted.job,
        user=sent.principal.name,
        render=submitted.render,
        shared=submitted.shared,
        replayed=submitted.replayed,
    )
    return submitted


def _needs_render(service: Service, sent: Submission, job: JobRow, spec: Spec) -> bool:
    """Whether there is neither a job of this request nor a render of its picture whose files are there.

    Raises
    ------
    QueueFullError
        If there is no room for another render: nothing is written to the store for it.
    """
    with service.database.reading() as session:
        if _sent_before(session, sent):
            return False
        found = _render_of(session, spec)
    if found is not None and (not found.state.final or damaged_files.has_files(service, found)):
        return False
    with service.database.reading() as session:
        job.load = job.predicted_cpu_seconds
        check_queue(session, service.settings, sent.principal, job, service.dispatcher.throughput.rate())
        return True


def _enter_job(service: Service, session: Session, entry: _Entry) -> SubmittedJob:
    sent, admitted, job, spec = entry.sent, entry.admitted, entry.job, entry.spec
    found = _render_of(session, spec)
    if found is not None:
        _share(job, found)
    elif not entry.kept:
        raise _RenderEndedError
    job.load = 0.0 if found else job.predicted_cpu_seconds
    rate = service.dispatcher.throughput.rate()
    queue = check_queue(session, service.settings, sent.principal, job, rate)
    if found is None:
        steps, course = _course(admitted, service.settings)
        job.render = _render(admitted, job.id, spec, steps, course)
        job.render.stored_bytes = len(spec.content)
        job.render.traceparent = service.spans.here()
    if job.render and not job.state.final:
        job.coarse_cpu_seconds = fairness.coarse_cpu_seconds(job.render)
    if found is not None and found.idle_since is not None:
        found.idle_since = job.finished_at
    session.add(job)
    session.flush()
    if found is None and job.render_number is not None:
        session.execute(_TILES, [rows.new_step(job.render_number, pass_, tile) for pass_, tile in steps])
        uploads.enter_uses(session, job.render_number, uploads.hashes_of(admitted.request.scene))
    _enter_parts(session, sent, job)
    if found is not None:
        sharing.follow(session, found)
    if not job.state.final:
        fairness.activate(session, [job.owner])
    render = found.id if found else job.id
    return SubmittedJob(job.id, replayed=False, render=render, shared=found is not None, queue=queue)


def _enter_parts(session: Session, sent: Submission, job: JobRow) -> None:
    session.execute(_REQUESTS, {"job": job.number, "body": zlib.compress(sent.body, 1)})
    if job.labels:
        labels = [
            {"job": job.number, "owner": job.owner, "name": name, "value": value}
            for name, value in job.labels.items()
        ]
        session.execute(_LABELS, labels)
    if sent.key is not None:
        row = IdempotencyRow(
            owner=job.owner,
            key=sent.key,
            body_sha256=sent.body_sha256,
            job=job.number,
            created_at=job.created_at,
        )
        # An expired key may still be there.
        session.merge(row)
        session.flush()


def _job(principal: Principal, admitted: Admitted) -> JobRow:
    request = admitted.request
    return JobRow(
        id=secrets.token_hex(8),
        owner=principal.name,
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


def _render_of(session: Session, spec: Spec) -> RenderRow | None:
    """Find a finished or running render of the same picture."""
    number = session.scalar(_SAME, {"sha256": spec.sha256, "version": spec.version})
    return None if number is None else session.get(RenderRow, number)


def _share(job: JobRow, render: RenderRow) -> None:
    """Let a job join a render. It has its own times, which reveal nothing of earlier jobs."""
    job.render, job.state = render, render.state
    if render.state is not JobState.QUEUED:
        job.started_at = job.created_at
    if render.state.final:
        job.finished_at = job.created_at


def _render(
    admitted: Admitted, render_id: str, spec: Spec, steps: list[targets.Step], course: dict[str, Any]
) -> RenderRow:
    plan = admitted.plan
    return RenderRow(
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
        **course,
    )


def _course(admitted: Admitted, settings: Settings) -> tuple[list[targets.Step], dict[str, Any]]:
    """The steps of a render, as far as they are known, and the columns of its progress."""
    plan, target = admitted.plan, admitted.target
    if target is not None:
        return targets.begin(plan, target, settings.tile_size, settings.workers)
    steps = [(pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, settings.tile_size)]
    return steps, {
        "total_work": sum(rows.work(pass_, tile) for pass_, tile in steps),
        "pass_costs": progress.begin_passes([pass_.index for pass_, _ in steps]),
        "error_unknown": progressive.unknown_error(plan),
    }
