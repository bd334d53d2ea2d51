"""Orphans in the store: files without a reference in the database, and tiles of ended renders."""

from __future__ import annotations

import structlog
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.errors import StoreError
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from service.storage.tiles import UNFINISHED_SECONDS, TileStore

log = structlog.get_logger()


def remove_orphans(database: Database, store: TileStore) -> None:
    """Remove files without a reference in the database, and tiles of ended renders."""
    try:
        with database.reading() as session:
            known, ended = _known_files(session)
        store.sweep(known, ended, UNFINISHED_SECONDS if database.shared else 0.0)
    except (SQLAlchemyError, OSError, StoreError) as error:
        log.warning("orphan cleanup failed", error=type(error).__name__)


def _known_files(session: Session) -> tuple[set[str], dict[str, str | None]]:
    """Return the ids of all renders, and those of the ended ones with the prefix of their final files."""
    renders = session.execute(select(RenderRow.id, RenderRow.state, RenderRow.final_prefix)).all()
    ended = {
        render: prefix if state is JobState.SUCCEEDED else None
        for render, state, prefix in renders
        if state.final
    }
    return {render for render, *_ in renders}, ended
