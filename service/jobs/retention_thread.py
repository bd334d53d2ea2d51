"""The thread that lets go what was kept long enough, now and then, and whenever somebody asks."""

from __future__ import annotations

import threading
from datetime import UTC, datetime, timedelta

import structlog
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from service.errors import StoreError
from service.jobs import retention
from service.jobs.retention import Rules, Swept
from service.storage.assets import AssetStore
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow
from service.storage.tiles import UNFINISHED_SECONDS, TileStore

SWEEP_SECONDS = 60.0
"""How often to look for what was kept long enough."""
MANY = 100
"""Jobs and assets removed in one transaction, so that others need not wait long."""
MOST_TOLD = 10_000
"""Of what would go, as much is told."""

log = structlog.get_logger()


class RetentionThread:
    """Applies the rules of retention to the database and to the disk.

    Several services of one database may have one each: what one has let go is not there for the other.
    """

    def __init__(self, database: Database, store: TileStore, assets: AssetStore, rules: Rules) -> None:
        self._database, self._store, self._assets = database, store, assets
        self.rules = rules
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="retention", daemon=True)

    def start(self) -> None:
        """Remove what an earlier service left behind, and begin."""
        with self._database.reading() as session:
            known = set(session.scalars(select(AssetRow.sha256)))
        age = UNFINISHED_SECONDS if self._database.shared else 0.0
        self._assets.sweep(known, self._unused_since(self.rules), age)
        self._thread.start()

    def stop(self) -> None:
        """Stop after the transaction under way."""
        self._stopping.set()
        self._thread.join()

    def prune(self, rules: Rules) -> Swept:
        """Let go what these rules do not keep, and tell what that was."""
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

    def foretell(self, rules: Rules) -> Swept:
        """Tell what would go by these rules: it goes, and comes back before anybody has seen it."""
        sizes = self._store.sizes()
        with self._database.writing() as session, session.begin_nested() as trial:
            swept = retention.sweep(session, rules, sizes, MOST_TOLD)
            trial.rollback()
        return swept

    def _run(self) -> None:
        pause = min(SWEEP_SECONDS, self.rules.keep_seconds or SWEEP_SECONDS)
        while not self._stopping.wait(pause):
            try:
                swept = self.prune(self.rules)
            except (SQLAlchemyError, StoreError) as error:
                log.warning("nothing swept, trying again", error=type(error).__name__)
                continue
            if swept.expired or swept.forgotten or swept.assets:
                counts = {"expired": len(swept.expired), "forgotten": len(swept.forgotten)}
                log.info("swept", **counts, assets=len(swept.assets), bytes=swept.bytes)

    def _swept(self, rules: Rules) -> Swept:
        sizes = self._store.sizes()
        with self._database.writing() as session:
            swept = retention.sweep(session, rules, sizes, MANY)
        for render in swept.pictures:
            self._store.drop_job(render)
        self._assets.drop(swept.assets, self._unused_since(rules))
        return swept

    def _unused_since(self, rules: Rules) -> datetime:
        kept = rules.keep_asset_seconds
        return datetime.now(UTC) - timedelta(seconds=retention.ASSET_GRACE if kept is None else kept)
