"""A sweep of retention over stored pictures, jobs and assets, by age and by size; and its dry run.

As in ``ledger.py`` a sweep works in a transaction of its caller.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from sqlalchemy import Row, bindparam, func, select, text
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.jobs import uploads
from service.lifecycle import damage, documents, sharing, totals
from service.storage.database.conditions import HAS_PICTURE, MAY_BE_FORGOTTEN
from service.storage.database.models import JobRow, RenderRow

KEY_LIFE = timedelta(hours=24)
"""Lifetime of an ``Idempotency-Key``."""

# Each has an index of its own, in this order: a sweep reads only the rows that it deletes.
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
HELD_BYTES = select(_OWNED.c.owner, func.sum(_OWNED.c.stored_bytes)).group_by(_OWNED.c.owner)
IDLE_ASSETS = (
    select(_OWNED.c.number, _OWNED.c.stored_bytes)
    .where(_OWNED.c.owner == bindparam("owner"), _OWNED.c.idle_since.is_not(None))
    .order_by(_OWNED.c.idle_since, _OWNED.c.number)
    .limit(bindparam("most"))
)


@dataclass(frozen=True)
class Rules:
    """Retention limits, each optional.

    Attributes
    ----------
    keep_seconds
        Age of pictures after their jobs succeeded; jobs are kept twice as long.
    max_stored_bytes
        Bytes of all finished pictures with their layers.
    keep_asset_seconds
        Age of assets that no render needs, since they were last sent or requested.
    """

    keep_seconds: float | None = None
    max_stored_bytes: int | None = None
    keep_asset_seconds: float | None = None


@dataclass
class Swept:
    """Record of what a sweep has deleted.

    Attributes
    ----------
    expired, forgotten
        Ids of jobs that have lost their picture, and of those that are gone.
    pictures, assets
        Bytes that leave the disk, by id: renders that no job refers to any more, and assets.
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
    return Counter({owner: int(count or 0) for owner, count in session.execute(HELD_BYTES)})


class Sweep:
    """Deletes what the rules do not keep.

    Parameters
    ----------
    held
        The counts of `held_bytes`; deleted bytes are subtracted.
    most
        Jobs and assets to remove at most, each: others wait for the transaction.
    """

    def __init__(self, session: Session, rules: Rules, held: Counter[str], most: int) -> None:
        self._session, self._rules, self._held, self._most = session, rules, held, most
        self._now, self._swept = datetime.now(UTC), Swept()

    def run(self) -> Swept:
        """Return what was deleted."""
        rules, swept = self._rules, self._swept
        if rules.keep_seconds is not None:
            self._by_age(timedelta(seconds=rules.keep_seconds))
        if rules.max_stored_bytes is not None and not swept.more:
            self._by_bytes(rules.max_stored_bytes)
        if rules.keep_asset_seconds is not None:
            swept.assets = self._drop_assets(self._now - timedelta(seconds=rules.keep_asset_seconds))
            swept.more = swept.more or len(swept.assets) == self._most
        return swept

    def _by_age(self, kept: timedelta) -> None:
        # Jobs to be forgotten go first: expiring their pictures before would be reported, too.
        for found, age, forgets, ended in (
            (FORGOTTEN, 2 * kept, True, self._swept.forgotten),
            (EXPIRING, kept, False, self._swept.expired),
        ):
            old = found.where(JobRow.finished_at < self._now - age).limit(self._most)
            numbers = self._session.scalars(old).all()
            for number in numbers:
                self._end(number, ended, forgets=forgets)
            # Where all are damaged, the next transaction would find the same ones.
            self._swept.more = len(numbers) == self._most and bool(ended)
            if self._swept.more:
                return

    def _by_bytes(self, limit: int) -> None:
        """Expire the oldest pictures of the user with the most bytes, until the rest fits.

        A user with fewer bytes loses no picture because of one with more.
        """
        held, expired = self._held, self._swept.expired
        idle: dict[str, Iterator[Row[int, int]]] = {}
        tried, before = 0, len(expired)
        while held and tried < self._most and self._stored() > limit:
            [(owner, _)] = held.most_common(1)
            if owner not in idle:
                names = {"owner": owner, "most": self._most}
                idle[owner] = iter(self._session.execute(IDLE_ASSETS, names).all())
            number, size = next(idle[owner], (None, 0))
            if number is None:
                del held[owner]
                continue
            held[owner] -= size
            tried += 1
            jobs = select(JobRow.number).where(JobRow.render_number == number, JobRow.owner == owner)
            for job in self._session.scalars(jobs).all():
                self._end(job, expired, forgets=False)
        # Where all are damaged, the next transaction would find the same ones.
        self._swept.more = tried == self._most and len(expired) > before

    def _end(self, number: int, ended: list[str], *, forgets: bool) -> None:
        """Expire or forget a job; one whose record is damaged stays as it is, and is logged."""
        job_id = self._session.scalars(select(JobRow.id).where(JobRow.number == number)).one()
        try:
            unused = self._removed(number, forgets=forgets)
        except damage.ROW_ERRORS as error:
            damage.note(job_id, error)
            return
        ended.append(job_id)
        if unused is not None:
            self._swept.pictures[unused.id] = unused.bytes

    def _removed(self, number: int, *, forgets: bool) -> sharing.Unused | None:
        """Expire or forget a job, and return its render if no other refers to it."""
        with self._session.begin_nested():
            job = self._session.get_one(JobRow, number)
            return (sharing.forget if forgets else sharing.expire)(self._session, job)

    def _stored(self) -> int:
        """Count the bytes of all pictures that are left."""
        return totals.read(self._session, totals.STORED_BYTES)

    def _drop_assets(self, before: datetime) -> dict[str, int]:
        return uploads.drop_unused(self._session, before, self._most)


class DryRun(Sweep):
    """A dry run of a sweep, in a read-only transaction that blocks nobody."""

    def __init__(self, session: Session, rules: Rules, held: Counter[str], most: int) -> None:
        super().__init__(session, rules, held, most)
        self._total = super()._stored()
        self._ended: set[int] = set()
        self._unused: set[int] = set()

    def _end(self, number: int, ended: list[str], *, forgets: bool) -> None:
        if number not in self._ended:
            super()._end(number, ended, forgets=forgets)

    def _removed(self, number: int, *, forgets: bool) -> sharing.Unused | None:
        job = self._session.get_one(JobRow, number)
        render = job.render
        if not forgets:
            # As expiring does, which a damaged record has no answer for.
            documents.work_of(job)
        self._ended.add(number)
        if render is None:
            return None
        sharing_it = select(JobRow.number).where(JobRow.render_number == render.number)
        if not self._ended.issuperset(self._session.scalars(sharing_it)):
            return None
        stored = render.stored_bytes or 0
        self._unused.add(render.number)
        self._total -= stored if render.state is JobState.SUCCEEDED else 0
        return sharing.Unused(render.id, stored)

    def _stored(self) -> int:
        return self._total

    def _drop_assets(self, before: datetime) -> dict[str, int]:
        return uploads.unused_without(self._session, self._unused, before, self._most)
