"""Retention: deletes pictures by age and by size, and assets that no picture needs.

As in ``ledger.py`` a sweep works in a transaction of its caller; what it names in ``pictures`` and ``assets``
leaves the disk when that is over, and what a killed process leaves there goes when the next service starts.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

import structlog
from sqlalchemy import delete, func, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.errors import StoreError
from service.jobs import uploads
from service.lifecycle import sharing
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, IdempotencyRow, JobRow, RenderRow
from service.storage.reserve import Reserve
from service.storage.tiles import UNFINISHED_SECONDS, TileStore

KEY_LIFE = timedelta(hours=24)
"""How long an ``Idempotency-Key`` is remembered."""
ASSET_GRACE = 86400.0
"""How old a file is that was sent and never entered into the database, seconds, where no rule says so."""

_FINISHED = select(JobRow).where(~JobRow.pinned).order_by(JobRow.finished_at, JobRow.number)
_STORED = select(RenderRow.id).where(RenderRow.state == JobState.SUCCEEDED)
# A render goes when its last job does, so the newest of them says how old it is.
_LOOSE = (
    select(RenderRow.number, RenderRow.id)
    .join(JobRow, JobRow.render_number == RenderRow.number)
    .where(RenderRow.state == JobState.SUCCEEDED)
    .group_by(RenderRow.number, RenderRow.id)
    .having(func.count().filter(JobRow.pinned) == 0)
    .order_by(func.max(JobRow.finished_at), RenderRow.number)
)


@dataclass(frozen=True)
class Rules:
    """How long and how much to keep; None is no limit.

    Attributes
    ----------
    keep_seconds
        Of a picture after its job has succeeded, and of the job after that.
    max_stored_bytes
        Of all finished pictures with their layers.
    keep_asset_seconds
        Of an asset that no render needs, since it was last sent or requested.
    """

    keep_seconds: float | None = None
    max_stored_bytes: int | None = None
    keep_asset_seconds: float | None = None


def rules_of(settings: Settings) -> Rules:
    """Return the rules of a service."""
    return Rules(settings.keep_seconds, settings.max_stored_bytes, settings.keep_asset_seconds)


@dataclass
class Swept:
    """What a sweep has deleted.

    Attributes
    ----------
    expired, forgotten
        Ids of jobs that have lost their picture, and of those that are gone.
    pictures, assets
        What leaves the disk, with its bytes: renders to which no job refers any more, and assets.
    more
        There was more than may go in one transaction.
    """

    expired: list[str] = field(default_factory=list)
    forgotten: list[str] = field(default_factory=list)
    pictures: dict[str, int] = field(default_factory=dict)
    assets: dict[str, int] = field(default_factory=dict)
    more: bool = False

    @property
    def bytes(self) -> int:
        """Bytes that were freed."""
        return sum(self.pictures.values()) + sum(self.assets.values())


def sweep(session: Session, rules: Rules, sizes: Mapping[str, int], most: int) -> Swept:
    """Delete what the rules do not keep.

    Parameters
    ----------
    sizes
        Bytes of the renders in the store, by id.
    most
        Jobs and assets to remove at most, each: others wait for the transaction.
    """
    now, swept = datetime.now(UTC), Swept()
    session.execute(delete(IdempotencyRow).where(IdempotencyRow.created_at < now - KEY_LIFE))
    if rules.keep_seconds is not None:
        _by_age(session, now, timedelta(seconds=rules.keep_seconds), sizes, swept, most)
    if rules.max_stored_bytes is not None and not swept.more:
        _by_bytes(session, rules.max_stored_bytes, sizes, swept, most)
    if rules.keep_asset_seconds is not None:
        before = now - timedelta(seconds=rules.keep_asset_seconds)
        swept.assets = uploads.drop_unused(session, before, most)
        swept.more = swept.more or len(swept.assets) == most
    return swept


def _by_age(
    session: Session, now: datetime, kept: timedelta, sizes: Mapping[str, int], swept: Swept, most: int
) -> None:
    old = _FINISHED.where(JobRow.state == JobState.SUCCEEDED, JobRow.finished_at < now - kept)
    gone = _FINISHED.where(JobRow.finished_at < now - 2 * kept)
    for row in session.scalars(gone.limit(most)).all():
        swept.forgotten.append(row.id)
        _note(swept, sharing.forget(session, row), sizes)
    for row in session.scalars(old.limit(most)).all():
        swept.expired.append(row.id)
        _note(swept, sharing.expire(session, row), sizes)
    swept.more = most in (len(swept.expired), len(swept.forgotten))


def _by_bytes(session: Session, limit: int, sizes: Mapping[str, int], swept: Swept, most: int) -> None:
    excess = sum(sizes.get(render, 0) for render in session.scalars(_STORED)) - limit
    if excess <= 0:
        return
    loose = session.execute(_LOOSE.limit(most)).all()
    for number, render in loose:
        for row in session.scalars(select(JobRow).where(JobRow.render_number == number)).all():
            swept.expired.append(row.id)
            _note(swept, sharing.expire(session, row), sizes)
        excess -= sizes.get(render, 0)
        if excess <= 0:
            return
    swept.more = len(loose) == most


def _note(swept: Swept, unused: str | None, sizes: Mapping[str, int]) -> None:
    if unused is not None:
        swept.pictures[unused] = sizes.get(unused, 0)


SWEEP_SECONDS = 60.0
"""How often to sweep, seconds."""
MANY = 100
"""Jobs and assets removed in one transaction, so that others need not wait long."""
MOST_PREDICTED = 10_000
"""Jobs and assets that a dry run reports at most, each."""

log = structlog.get_logger()


class RetentionThread:
    """Applies the rules of retention to the database and to the disk.

    Several services of one database may have one each: what one has deleted is not there for the other.
    """

    def __init__(
        self, database: Database, store: TileStore, assets: AssetStore, rules: Rules, reserve: Reserve
    ) -> None:
        self._database, self._store, self._assets = database, store, assets
        self._reserve = reserve
        self.rules = rules
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="retention", daemon=True)

    def start(self) -> None:
        """Remove what an earlier service left behind, and begin."""
        with self._database.reading() as session:
            known = set(session.scalars(select(AssetRow.sha256)))
        age = UNFINISHED_SECONDS if self._database.shared else 0.0
        self._assets.sweep(known, self._unused_since(self.rules), age)
        self._reserve.keep()
        self._thread.start()

    def stop(self) -> None:
        """Stop after the transaction under way."""
        self._stopping.set()
        self._thread.join()

    def prune(self, rules: Rules) -> Swept:
        """Delete what these rules do not keep, and report it."""
        whole = Swept(more=True)
        while whole.more and not self._stopping.is_set():
            part = self._swept(rules)
            whole = Swept(
                whole.expired + part.expired,
                whole.forgotten + part.forgotten,
                whole.pictures | part.pictures,
                whole.assets | part.assets,
                part.more,
            )
        return whole

    def predict(self, rules: Rules) -> Swept:
        """Report what these rules would delete, by deleting it in a transaction that is rolled back."""
        sizes = self._store.sizes()
        with self._database.writing() as session, session.begin_nested() as trial:
            swept = sweep(session, rules, sizes, MOST_PREDICTED)
            trial.rollback()
        return swept

    def _run(self) -> None:
        pause = min(SWEEP_SECONDS, self.rules.keep_seconds or SWEEP_SECONDS)
        while not self._stopping.wait(pause):
            try:
                with self._reserve.given_up():
                    swept = self.prune(self.rules)
                self._reserve.keep()
            except (SQLAlchemyError, StoreError) as error:
                log.warning("nothing swept, trying again", error=type(error).__name__)
                continue
            if swept.expired or swept.forgotten or swept.assets:
                counts = {"expired": len(swept.expired), "forgotten": len(swept.forgotten)}
                log.info("swept", **counts, assets=len(swept.assets), bytes=swept.bytes)

    def _swept(self, rules: Rules) -> Swept:
        sizes = self._store.sizes()
        with self._database.writing() as session:
            swept = sweep(session, rules, sizes, MANY)
        for render in swept.pictures:
            self._store.drop_job(render)
        self._assets.drop(swept.assets, self._unused_since(rules))
        return swept

    def _unused_since(self, rules: Rules) -> datetime:
        kept = rules.keep_asset_seconds
        return datetime.now(UTC) - timedelta(seconds=ASSET_GRACE if kept is None else kept)
