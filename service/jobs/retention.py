"""Retention: deletes pictures by age and by size, and assets that no picture needs.

As in ``ledger.py`` a sweep works in a transaction of its caller; what it names in ``pictures`` and ``assets``
leaves the disk when that is over, and what a killed process leaves there goes when the next service starts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta

import structlog
from sqlalchemy import Row, and_, bindparam, delete, func, or_, select, text, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.errors import StoreError
from service.jobs import uploads
from service.jobs.sweep_clock import SweepClock
from service.lifecycle import damage, sharing, totals
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.conditions import HAS_PICTURE, MAY_BE_FORGOTTEN, UNMEASURED
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, IdempotencyRow, JobRow, RenderRow
from service.storage.reserve import Reserve
from service.storage.tiles import UNFINISHED_SECONDS, TileStore
from service.supervision import SupervisedThread

KEY_LIFE = timedelta(hours=24)
"""How long an ``Idempotency-Key`` is remembered."""
ASSET_GRACE = 86400.0
"""How old a file is that was sent and never entered into the database, seconds, where no rule says so."""

# Each has an index of its own, in this order: a sweep reads what it deletes, and nothing that it keeps.
_OLDEST = select(JobRow.number).order_by(JobRow.finished_at, JobRow.number)
EXPIRING, FORGOTTEN = _OLDEST.where(text(HAS_PICTURE)), _OLDEST.where(text(MAY_BE_FORGOTTEN))
# Users may share a render, whose bytes are those of each; a user's jobs may, too, and there they count once.
_OWNED = (
    select(JobRow.owner, RenderRow.number, RenderRow.stored_bytes, RenderRow.idle_since)
    .join(RenderRow, JobRow.render_number == RenderRow.number)
    .where(RenderRow.state == JobState.SUCCEEDED)
    .distinct()
    .subquery()
)
HELD = select(_OWNED.c.owner, func.sum(_OWNED.c.stored_bytes)).group_by(_OWNED.c.owner)
IDLE = (
    select(_OWNED.c.number, _OWNED.c.stored_bytes)
    .where(_OWNED.c.owner == bindparam("owner"), _OWNED.c.idle_since.is_not(None))
    .order_by(_OWNED.c.idle_since, _OWNED.c.number)
    .limit(bindparam("most"))
)
WITHOUT_SIZE = select(RenderRow.number, RenderRow.id).where(text(UNMEASURED)).order_by(RenderRow.number)


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


def held_bytes(session: Session, rules: Rules) -> Counter[str]:
    """Count the bytes of each user's pictures, pinned ones included, if all together have too many."""
    limit = rules.max_stored_bytes
    if limit is None or totals.read(session, totals.STORED_BYTES) <= limit:
        return Counter()
    return Counter({owner: int(count or 0) for owner, count in session.execute(HELD)})


def sweep(session: Session, rules: Rules, held: Counter[str], most: int) -> Swept:
    """Delete what the rules do not keep.

    Parameters
    ----------
    held
        What `held_bytes` has counted; what is deleted is subtracted.
    most
        Jobs and assets to remove at most, each: others wait for the transaction.
    """
    now, swept = datetime.now(UTC), Swept()
    session.execute(delete(IdempotencyRow).where(IdempotencyRow.created_at < now - KEY_LIFE))
    if rules.keep_seconds is not None:
        _by_age(session, now, timedelta(seconds=rules.keep_seconds), swept, most)
    if rules.max_stored_bytes is not None and not swept.more:
        _by_bytes(session, rules.max_stored_bytes, held, swept, most)
    if rules.keep_asset_seconds is not None:
        before = now - timedelta(seconds=rules.keep_asset_seconds)
        swept.assets = uploads.drop_unused(session, before, most)
        swept.more = swept.more or len(swept.assets) == most
    return swept


def _by_age(session: Session, now: datetime, kept: timedelta, swept: Swept, most: int) -> None:
    # What is to be forgotten goes first, so that none of it loses its picture before, on its own.
    for found, age, end, ended in (
        (FORGOTTEN, 2 * kept, sharing.forget, swept.forgotten),
        (EXPIRING, kept, sharing.expire, swept.expired),
    ):
        numbers = session.scalars(found.where(JobRow.finished_at < now - age).limit(most)).all()
        for number in numbers:
            _end(session, number, end, swept, ended)
        # Where all are damaged, the next transaction would find the same ones.
        swept.more = len(numbers) == most and bool(ended)
        if swept.more:
            return


def _by_bytes(session: Session, limit: int, held: Counter[str], swept: Swept, most: int) -> None:
    """Expire the oldest pictures of whoever has the most bytes, until all that is left fits.

    What one user stores costs no other a picture who stores less.
    """
    idle: dict[str, Iterator[Row[int, int]]] = {}
    tried, before = 0, len(swept.expired)
    while held and tried < most and totals.read(session, totals.STORED_BYTES) > limit:
        [(owner, _)] = held.most_common(1)
        if owner not in idle:
            idle[owner] = iter(session.execute(IDLE, {"owner": owner, "most": most}).all())
        number, size = next(idle[owner], (None, 0))
        if number is None:
            del held[owner]
            continue
        held[owner] -= size
        tried += 1
        jobs = select(JobRow.number).where(JobRow.render_number == number, JobRow.owner == owner)
        for job in session.scalars(jobs).all():
            _end(session, job, sharing.expire, swept, swept.expired)
    # Where all are damaged, the next transaction would find the same ones.
    swept.more = tried == most and len(swept.expired) > before


def _end(
    session: Session,
    number: int,
    end: Callable[[Session, JobRow], sharing.Unused | None],
    swept: Swept,
    ended: list[str],
) -> None:
    """End a job by expiring or forgetting it; one whose record is damaged stays as it is, and is logged."""
    job_id = session.scalars(select(JobRow.id).where(JobRow.number == number)).one()
    try:
        with session.begin_nested():
            unused = end(session, session.get_one(JobRow, number))
    except damage.UNREADABLE as error:
        damage.note(job_id, error)
        return
    ended.append(job_id)
    _note(swept, unused)


def _note(swept: Swept, unused: sharing.Unused | None) -> None:
    if unused is not None:
        swept.pictures[unused.id] = unused.bytes


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
    """Enter the sizes of pictures that an earlier version has left; the store is listed once for them."""
    with database.reading() as session:
        found = session.execute(WITHOUT_SIZE).all()
    sizes = store.sizes() if found else {}
    for start in range(0, len(found), MANY):
        with database.writing() as session:
            for number, render in found[start : start + MANY]:
                _enter_size(session, number, sizes.get(render, 0))


def _enter_size(session: Session, number: int, size: int) -> None:
    unknown = update(RenderRow).where(RenderRow.number == number, text(UNMEASURED))
    if session.execute(unknown.values(stored_bytes=size).returning(RenderRow.number)).all():
        totals.add(session, totals.STORED_BYTES, size)


SWEEP_SECONDS = 60.0
"""How often to sweep, seconds."""
MOST_DELETED = 0.1
"""Share of all jobs and assets that may go after a jump of the clock: all look old to one that is wrong."""
CURE = "Set the clock right. If it is right, run 'penumbra prune': it deletes what is old, and sweeps go on."
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
        """Delete what these rules do not keep, and report it: whoever asks for it believes the clock."""
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
        """Report what these rules would delete, by deleting it in a transaction that is rolled back."""
        held = self._measured(rules)
        with self._database.writing() as session, session.begin_nested() as trial:
            swept = sweep(session, rules, held, MOST_PREDICTED)
            trial.rollback()
        return swept

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
            log.error("clock jumped, nothing deleted by age", ahead=str(ahead), cure=CURE)
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
            swept = sweep(session, rules, held, MANY)
        for render in swept.pictures:
            self._store.drop_job(render)
        self._assets.drop(swept.assets, self._unused_since(rules))
        return swept

    def _unused_since(self, rules: Rules) -> datetime:
        kept = rules.keep_asset_seconds
        return datetime.now(UTC) - timedelta(seconds=ASSET_GRACE if kept is None else kept)
