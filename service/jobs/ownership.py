"""Who has uploaded which assets. To all others there is no such asset, even where its bytes are kept.

The bytes are kept once, however many have sent them. An answer depends on what its user has sent, so
nobody learns from the hash of a file whether somebody else has it. Those who see the jobs of all see what
these are made of, too.
"""

from __future__ import annotations

from collections.abc import Collection
from datetime import UTC, datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.access.principals import Principal
from service.storage.database.models import AssetOwnerRow, AssetRow


def enter(session: Session, row: AssetRow, owner: str) -> AssetRow:
    """Enter an asset as uploaded by a user; what was entered before is used again."""
    kept = session.get(AssetRow, row.sha256)
    if kept is None:
        session.add(row)
        session.flush()
    else:
        kept.used_at = row.used_at
    if session.get(AssetOwnerRow, (owner, row.sha256)) is None:
        session.add(AssetOwnerRow(owner=owner, sha256=row.sha256, created_at=datetime.now(UTC)))
    return kept or row


def find(session: Session, sha256: str, principal: Principal) -> AssetRow | None:
    """Give an asset that this user may use."""
    return session.get(AssetRow, sha256) if usable(session, {sha256}, principal) else None


def usable(session: Session, hashes: Collection[str], principal: Principal) -> dict[str, str]:
    """Give those of the assets that this user may use, each with its media type."""
    query = select(AssetRow.sha256, AssetRow.media_type).where(AssetRow.sha256.in_(hashes))
    if not principal.sees_all:
        query = query.join(AssetOwnerRow, AssetOwnerRow.sha256 == AssetRow.sha256)
        query = query.where(AssetOwnerRow.owner == principal.name)
    return dict(session.execute(query).tuples().all())


def bytes_of(session: Session, owner: str, *, apart_from: str) -> int:
    """Count the bytes of all other assets of a user."""
    query = (
        select(func.coalesce(func.sum(AssetRow.bytes), 0))
        .join(AssetOwnerRow, AssetOwnerRow.sha256 == AssetRow.sha256)
        .where(AssetOwnerRow.owner == owner, AssetOwnerRow.sha256 != apart_from)
    )
    return int(session.scalar(query) or 0)
