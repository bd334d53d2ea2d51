"""Submission: reads, checks and prices a request, or finds an earlier one with the same key."""

from __future__ import annotations

import hashlib
import json
import zlib
from dataclasses import dataclass
from datetime import UTC, datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.access.principals import Principal
from service.errors import ReusedKeyError
from service.jobs import canonical
from service.jobs.admission import Admitted, admit
from service.jobs.canonical import Spec
from service.jobs.context import Service
from service.jobs.limits import Queue
from service.jobs.sweep import KEY_LIFE
from service.storage.database.models import IdempotencyRow, JobRow, RequestRow


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
        The request without whitespace.
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
    """A job that was accepted, now or by an earlier request with the same key.

    Attributes
    ----------
    job : str
    replayed : bool
        Whether an earlier request submitted it.
    render : str or None
        The job that its picture was rendered for.
    shared : bool
        Whether the picture existed, or was being rendered.
    queue : Queue or None
        The state of the queue with it.
    """

    job: str
    replayed: bool
    render: str | None = None
    shared: bool = False
    queue: Queue | None = None


async def prepare(service: Service, sent: Submission) -> Prepared | SubmittedJob:
    """Read, check and price a request, or return the job of the same request that came before.

    All slow work for a large request is done here, before a transaction that blocks others. Raises as `admit`
    does.
    """
    user = sent.principal.name
    before = None if sent.key is None else await service.read(user, _same_before, service, sent)
    if before is not None:
        return before
    return await service.read(user, _packed, sent, await admit(service, sent.principal, sent.body))


def _packed(sent: Submission, admitted: Admitted) -> Prepared:
    body = canonical.compact(sent.body)
    spec = canonical.private_spec(body) if sent.anew else canonical.spec_of(admitted.request)
    return Prepared(sent, admitted, spec, body, zlib.compress(body, 1))


def _same_before(service: Service, sent: Submission) -> SubmittedJob | None:
    """Return the job of the same bytes with the same key."""
    with service.database.reading() as session:
        before = _sent_before(session, sent)
        if before is None or before.body_sha256 != sent.body_sha256:
            return None
        return SubmittedJob(_job_of(session, before), replayed=True)


def _sent_before(session: Session, sent: Submission) -> IdempotencyRow | None:
    """Find an earlier request with the same key, unless it is too old."""
    if sent.key is None:
        return None
    row = session.get(IdempotencyRow, (sent.principal.name, sent.key))
    return row if is_recent(row) else None


def is_recent(row: IdempotencyRow | None) -> bool:
    """Whether there is an earlier request with a key that is still remembered."""
    return row is not None and row.created_at >= datetime.now(UTC) - KEY_LIFE


def _job_of(session: Session, before: IdempotencyRow) -> str:
    return session.scalars(select(JobRow.id).where(JobRow.number == before.job)).one()


def replayed(service: Service, prepared: Prepared) -> SubmittedJob | None:
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
