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
class Prepared:
    """A request that may be carried out, and what the store and the database keep of it.

    Attributes
    ----------
    spec : Spec
        What is rendered, and identifies equal pictures.
    body : bytes
        The request without blanks.
    stored : bytes
        The same, compressed.
    """

    sent: Submission
    admitted: Admitted
    spec: Spec
    body: bytes
    stored: bytes


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


def prepare(service: Service, sent: Submission) -> Prepared | SubmittedJob:
    """Read, check and price a request, or return the job of the same request that came before.

    All that takes long for a large request is done here, before a transaction that others wait for.

    Raises
    ------
    renderer.SceneError
        If the request cannot be used.
    """
    with service.database.reading() as session:
        before = _sent_before(session, sent)
        if before is not None and before.body_sha256 == sent.body_sha256:
            return SubmittedJob(_job_of(session, before), replayed=True)
    admitted, body = admit(service, sent.principal, sent.body), canonical.compact(sent.body)
    spec = canonical.private_spec(body) if sent.anew else canonical.spec_of(admitted.request)
    return Prepared(sent, admitted, spec, body, zlib.compress(body, 1))


def enter(service: Service, prepared: Prepared) -> SubmittedJob:
    """Enter a job, or return the job of an equal request with the same key.

    Raises
    ------
    ReusedKeyError
        If its key came with another request before.
    QueueFullError
        If it does not fit into the queue now.
    """
    for number in range(TRIES - 1):
        try:
            return _enter(service, prepared, alone=number > 0)
        except (IntegrityError, _OvertakenError):
            log.debug("another request was faster")
    return _enter(service, prepared, alone=True)


def _sent_before(session: Session, sent: Submission) -> IdempotencyRow | None:
    """Find an earlier request with the same key, unless it is too old."""
    if sent.key is None:
        return None
    row = session.get(IdempotencyRow, (sent.principal.name, sent.key))
    return None if row is None or row.created_at < datetime.now(UTC) - KEY_LIFE else row


def _job_of(session: Session, before: IdempotencyRow) -> str:
    return session.scalars(select(JobRow.id).where(JobRow.number == before.job)).one()


def _replayed(service: Service, prepared: Prepared) -> SubmittedJob | None:
    """Return the job of an earlier request with the same key and the same document."""
    with service.database.reading() as session:
        before = _sent_before(session, prepared.sent)
        if before is None:
            return None
        job, stored = _job_of(session, before), session.get_one(RequestRow, before.job).body
    # They may differ in how JSON is written: the order of members, 32.0 for 32. Booleans equal numbers in
    # Python, but no field of an admitted request takes both.
    if before.body_sha256 != prepared.sent.body_sha256 and (
        json.loads(zlib.decompress(stored)) != json.loads(prepared.body)
    ):
        assert prepared.sent.key is not None
        raise ReusedKeyError(prepared.sent.key)
    return SubmittedJob(job, replayed=True)


class _OvertakenError(Exception):
    """Another request has come with the key meanwhile, or the render to join has ended."""


@dataclass(frozen=True)
class _Entry:
    """What is about to be entered.

    Attributes
    ----------
    kept : bool
        Whether the store has what a render of its own needs.
    """

    prepared: Prepared
    job: JobRow
    kept: bool


def _enter(service: Service, prepared: Prepared, *, alone: bool) -> SubmittedJob:
    """Enter a job once.

    Parameters
    ----------
    alone
        Whether to prepare for a render of its own in any case. Otherwise nothing is written to the store
        where there is a render to join, and if that has ended meanwhile, the job is not entered.
    """
    known = _replayed(service, prepared) if prepared.sent.key is not None else None
    if known is not None:
        return known
    job = _job(prepared)
    entry = _Entry(prepared, job, kept=alone or _needs_render(service, prepared, job))
    try:
        if entry.kept:
            # Before the transaction, which would keep others waiting for the store. Workers look for it as
            # soon as that is over.
            service.store.put_spec(job.id, prepared.spec.content)
        with service.database.writing() as session:
            submitted = _enter_job(service, session, entry)
            service.database.notify(session, work=True)
    except BaseException as error:
        # Where the connection was lost it is unknown whether the job was entered.
        if entry.kept and not (isinstance(error, DBAPIError) and error.connection_invalidated):
            service.store.drop_job(job.id)
        raise
    if entry.kept and submitted.render != job.id:
        service.store.drop_job(job.id)
    _announce(service, prepared.sent.principal, submitted)
    return submitted


def _announce(service: Service, principal: Principal, submitted: SubmittedJob) -> None:
    service.dispatcher.wake()
    service.spans.taken(submitted.job, submitted.render, shared=submitted.shared)
    names = {"job": submitted.job, "render": submitted.render, "shared": submitted.shared}
    log.info("job taken", user=principal.name, **names)


def _needs_render(service: Service, prepared: Prepared, job: JobRow) -> bool:
    """Whether there is no render of the picture whose files are there.

    Raises
    ------
    QueueFullError
        If there is no room for another render: nothing is written to the store for it.
    """
    with service.database.reading() as session:
        found = _render_of(session, prepared.spec)
    if found is not None and (not found.state.final or damaged_files.has_files(service, found)):
        return False
    with service.database.reading() as session:
        job.load = job.predicted_cpu_seconds
        rate = service.dispatcher.throughput.rate()
        check_queue(session, service.settings, prepared.sent.principal, job, rate)
        return True


def _enter_job(service: Service, session: Session, entry: _Entry) -> SubmittedJob:
    prepared, job = entry.prepared, entry.job
    sent, admitted, spec = prepared.sent, prepared.admitted, prepared.spec
    if _sent_before(session, sent):
        raise _OvertakenError
    found = _render_of(session, spec)
    if found is not None:
        _share(job, found)
    elif not entry.kept:
        raise _OvertakenError
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
    _enter_parts(session, prepared, job)
    if found is not None:
        sharing.follow(session, found)
    if not job.state.final:
        fairness.activate(session, [job.owner])
    render = found.id if found else job.id
    return SubmittedJob(job.id, replayed=False, render=render, shared=found is not None, queue=queue)


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
