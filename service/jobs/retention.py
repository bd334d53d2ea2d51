"""Retention: deletes pictures by age and by size, and assets that no picture needs.

As in ``ledger.py`` a sweep works in a transaction of its caller; what it names in ``pictures`` and ``assets``
leaves the disk when that is over, and what a killed process leaves there goes when the next service starts.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import structlog
from sqlalchemy import and_, delete, func, or_, select, text, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from service.errors import StoreError
from service.jobs import uploads
from service.jobs.sweep import KEY_LIFE, DryRun, Rules, Sweep, Swept, held_bytes
from service.jobs.sweep_clock import SweepClock
from service.lifecycle import totals
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.conditions import HAS_PICTURE, MAY_BE_FORGOTTEN, UNMEASURED
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, IdempotencyRow, JobRow, RenderRow
from service.storage.reserve import Reserve
from service.storage.tiles import UNFINISHED_SECONDS, TileStore
from service.supervision import SupervisedThread

ASSET_GRACE = 86400.0
"""Age at which a file without a row in the database is deleted, seconds, unless a rule says otherwise."""

WITHOUT_SIZE = select(RenderRow.number, RenderRow.id).where(text(UNMEASURED)).order_by(RenderRow.number)


def rules_of(settings: Settings) -> Rules:
    """Return the rules of a service."""
    return Rules(settings.keep_seconds, settings.max_stored_bytes, settings.keep_asset_seconds)


def deletes_too_much(session: Session, rules: Rules) -> bool:
    """Whether more than a tenth of all jobs and assets is older than the rules keep."""
    now, parts = datetime.now(UTC), []
    if rules.keep_seconds is not None:
        kept = timedelta(seconds=rules.keep_seconds)
        expiring = and_(text(HAS_PICTURE), JobRow.finished_at < now - kept)
        forgotten = and_(text(MAY_BE_FORGOTTEN), JobRow.finished_at < now - 2 * kept)
        parts.append(select(func.count()).select_from(JobRow).where(or_(expiring, forgotten)))
    if rules.keep_asset_seconds is not None:
        parts.append(uploads.counted_unused(now - timedelta(seconds=rules.keep_asset_seconds)))
    everything = [select(func.count()).select_from(row) for row in (JobRow, AssetRow)]
    old, kept_now = (sum(session.scalars(one).one() for one in counts) for counts in (parts, everything))
    return old > MOST_DELETED * kept_now


def measure(database: Database, store: TileStore) -> None:
    """Record the sizes of pictures of an earlier version, by listing the store once."""
    with database.reading() as session:
        found = session.execute(WITHOUT_SIZE).all()
    sizes = store.sizes() if found else {}
    for start in range(0, len(found), REMOVED_AT_ONCE):
        with database.writing() as session:
            for number, render in found[start : start + REMOVED_AT_ONCE]:
                _enter_size(session, number, sizes.get(render, 0))


def _enter_size(session: Session, number: int, size: int) -> None:
    unknown = update(RenderRow).where(RenderRow.number == number, text(UNMEASURED))
    if session.execute(unknown.values(stored_bytes=size).returning(RenderRow.number)).all():
        totals.add(session, totals.STORED_BYTES, size)


SWEEP_SECONDS = 60.0
"""Interval between sweeps, seconds."""
MOST_DELETED = 0.1
"""Largest share of all jobs and assets to delete after a jump: to a wrong clock, all look old."""
CLOCK_CURE = (
    "Set the clock right. If it is right, run 'penumbra prune': it deletes what is old, and sweeps go on."
)
REMOVED_AT_ONCE = 100
"""Jobs and assets removed in one transaction, so that others need not wait long."""
MOST_PREDICTED = 10_000
"""Jobs and assets that a dry run reports at most, each."""

log = structlog.get_logger()


class RetentionThread:
    """Applies the rules of retention to the database and to the disk.

    Several services on one database may each have one: what one has deleted is gone for the others.
    """

    def __init__(
        self, database: Database, store: TileStore, assets: AssetStore, rules: Rules, reserve: Reserve
    ) -> None:
        self._database, self._store, self._assets = database, store, assets
        self._reserve = reserve
        self.rules = rules
        self._clock, self._is_holding_back = SweepClock(database), False
        self._thread = SupervisedThread("retention", self._run, expected=(SQLAlchemyError, StoreError))

    def start(self) -> None:
        """Remove what an earlier service left behind, and begin."""
        with self._reserve.given_up():
            self._clock.start()
            with self._database.reading() as session:
                known = set(session.scalars(select(AssetRow.sha256)))
            age = UNFINISHED_SECONDS if self._database.shared else 0.0
            self._assets.sweep(known, self._unused_since(self.rules), age)
        self._reserve.keep()
        self._thread.start()

    def stop(self) -> None:
        """Stop after the transaction under way."""
        self._thread.stop()

    def is_failing(self) -> bool:
        """Whether nothing can be swept, and has not been for a while."""
        return self._thread.is_failing()

    def prune(self, rules: Rules) -> Swept:
        """Delete what these rules do not keep, and report it; the caller vouches for the clock."""
        swept = self._pruned(rules)
        self._clock.trust()
        return swept

    def _pruned(self, rules: Rules) -> Swept:
        held, whole = self._measured(rules), Swept(more=True)
        while whole.more and not self._thread.stopping.is_set():
            part = self._swept(rules, held)
            whole = Swept(
                whole.expired + part.expired,
                whole.forgotten + part.forgotten,
                whole.pictures | part.pictures,
                whole.assets | part.assets,
                part.more,
            )
        return whole

    def predict(self, rules: Rules) -> Swept:
        """Report what these rules would delete."""
        held = self._measured(rules)
        with self._database.reading() as session:
            return DryRun(session, rules, held, MOST_PREDICTED).run()

    def _run(self) -> None:
        pause = min(SWEEP_SECONDS, self.rules.keep_seconds or SWEEP_SECONDS)
        while not self._thread.stopping.wait(pause):
            with self._reserve.given_up():
                swept = self._sweep()
            self._reserve.keep()
            self._thread.note_success()
            if swept.expired or swept.forgotten or swept.assets:
                counts = {"expired": len(swept.expired), "forgotten": len(swept.forgotten)}
                log.info("swept", **counts, assets=len(swept.assets), bytes=swept.bytes)

    def _sweep(self) -> Swept:
        """Apply the rules of the service; after a jump of the clock only if they do not delete too much."""
        ahead = self._clock.jump()
        with self._database.reading() as session:
            holds_back = bool(ahead) and deletes_too_much(session, self.rules)
        if holds_back and not self._is_holding_back:
            log.error("clock jumped; nothing deleted by age", ahead=str(ahead), cure=CLOCK_CURE)
        self._is_holding_back = holds_back
        if holds_back:
            return self._pruned(replace(self.rules, keep_seconds=None, keep_asset_seconds=None))
        return self.prune(self.rules)

    def _measured(self, rules: Rules) -> Counter[str]:
        measure(self._database, self._store)
        with self._database.reading() as session:
            return held_bytes(session, rules)

    def _swept(self, rules: Rules, held: Counter[str]) -> Swept:
        with self._database.writing() as session:
            session.execute(
                delete(IdempotencyRow).where(IdempotencyRow.created_at < datetime.now(UTC) - KEY_LIFE)
            )
            swept = Sweep(session, rules, held, REMOVED_AT_ONCE).run()
        for render in swept.pictures:
            self._store.drop_job(render)
        self._assets.drop(swept.assets, self._unused_since(rules))
        return swept

    def _unused_since(self, rules: Rules) -> datetime:
        kept = rules.keep_asset_seconds
        return datetime.now(UTC) - timedelta(seconds=ASSET_GRACE if kept is None else kept)
