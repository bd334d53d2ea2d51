"""Uploaded assets: who may use them, and for how long they are needed.

The bytes of an asset are stored once, however many users have sent them; to all other users it does not
exist, so that a hash does not reveal whether another user has the file. Users who see everybody's jobs see
their assets.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import TypeVar

from sqlalchemy import Select, delete, func, insert, select, text, update
from sqlalchemy.orm import Session

from schemas.scene import Scene
from schemas.shapes import MeshFile
from schemas.textures import ImageTexture
from service.access.principals import Principal
from service.errors import UnavailableError
from service.storage.assets import PREFIX
from service.storage.database.models import AssetOwnerRow, AssetRow, AssetUseRow


def enter_upload(session: Session, row: AssetRow, owner: str) -> AssetRow:
    """Record that a user has uploaded an asset."""
    kept = session.get(AssetRow, row.sha256)
    if kept is None:
        session.add(row)
        session.flush()
    else:
        kept.used_at = row.used_at
    if session.get(AssetOwnerRow, (owner, row.sha256)) is None:
        session.add(AssetOwnerRow(owner=owner, sha256=row.sha256, created_at=datetime.now(UTC)))
    return kept or row


def find_upload(session: Session, sha256: str, principal: Principal) -> AssetRow | None:
    """Return an asset that this user may use."""
    return session.get(AssetRow, sha256) if usable(session, {sha256}, principal) else None


def usable(session: Session, hashes: Collection[str], principal: Principal) -> dict[str, str]:
    """Return the assets that this user may use, with their media types."""
    query = select(AssetRow.sha256, AssetRow.media_type).where(AssetRow.sha256.in_(hashes))
    if not principal.sees_all:
        query = query.join(AssetOwnerRow, AssetOwnerRow.sha256 == AssetRow.sha256)
        query = query.where(AssetOwnerRow.owner == principal.name)
    return dict(session.execute(query).all())


def bytes_of(session: Session, owner: str, *, apart_from: str) -> int:
    """Count the bytes of all other assets of a user."""
    query = (
        select(func.coalesce(func.sum(AssetRow.bytes), 0))
        .join(AssetOwnerRow, AssetOwnerRow.sha256 == AssetRow.sha256)
        .where(AssetOwnerRow.owner == owner, AssetOwnerRow.sha256 != apart_from)
    )
    return int(session.scalar(query) or 0)


# Least seconds between two recorded requests for an asset.
NOTE_INTERVAL = timedelta(minutes=1)

# As in the index of such assets, so that SQLite uses it.
_UNUSED = text("renders = 0")


def hashes_of(scene: Scene) -> set[str]:
    """Return the SHA-256 of all assets of a scene."""
    names = [texture.asset for texture in scene.textures.values() if isinstance(texture, ImageTexture)]
    names += [shape.asset for shape in scene.shapes if isinstance(shape, MeshFile)]
    return {name.removeprefix(PREFIX) for name in names}


def check_uses(session: Session, hashes: set[str]) -> None:
    """Check that assets are still there.

    Raises
    ------
    UnavailableError
        If one of them has gone since the request was checked.
    """
    if known_hashes(session, hashes) != hashes:
        raise UnavailableError("An asset of the scene was removed just now. Send the request again.")


def enter_uses(session: Session, render: int, hashes: set[str]) -> None:
    """Keep assets as long as a render exists."""
    rows = [{"render": render, "sha256": sha256} for sha256 in sorted(hashes)]
    if rows:
        session.execute(insert(AssetUseRow), rows)
        needed = update(AssetRow).where(AssetRow.sha256.in_(hashes))
        session.execute(needed.values(renders=AssetRow.renders + 1))


def known_hashes(session: Session, hashes: set[str]) -> set[str]:
    """Return those of these assets that exist."""
    if not hashes:
        return set()
    return set(session.scalars(select(AssetRow.sha256).where(AssetRow.sha256.in_(hashes))))


def is_due(row: AssetRow) -> bool:
    """Whether another request for an asset is to be recorded."""
    return row.used_at < datetime.now(UTC) - NOTE_INTERVAL


def note(session: Session, sha256: str) -> None:
    """Record that an asset was requested just now, and will probably be used."""
    session.execute(update(AssetRow).where(AssetRow.sha256 == sha256).values(used_at=datetime.now(UTC)))


def counted_unused(before: datetime) -> Select[int]:
    """Select the number of assets that `drop_unused` would delete."""
    return select(func.count()).select_from(AssetRow).where(_UNUSED, AssetRow.used_at < before)


def drop_unused(session: Session, before: datetime, most: int) -> dict[str, int]:
    """Delete assets that no render needs and that were not requested since; return them with their bytes."""
    old = select(AssetRow.sha256, AssetRow.bytes).where(_UNUSED, AssetRow.used_at < before)
    found = dict(session.execute(old.order_by(AssetRow.used_at).limit(most)).all())
    for sha256 in _recounted(session, found):
        del found[sha256]
    session.execute(delete(AssetRow).where(AssetRow.sha256.in_(found)))
    return found


def _recounted(session: Session, hashes: Collection[str]) -> Sequence[str]:
    """Recount the renders of assets, since servers of version 0.1 counted none."""
    uses = select(func.count()).where(AssetUseRow.sha256 == AssetRow.sha256).scalar_subquery()
    counted = update(AssetRow).where(AssetRow.sha256.in_(hashes), uses > 0).values(renders=uses)
    options = {"synchronize_session": False}
    return session.scalars(counted.returning(AssetRow.sha256), execution_options=options).all()


def unused_without(session: Session, renders: Collection[int], before: datetime, most: int) -> dict[str, int]:
    """Return what `drop_unused` would delete if these renders were gone."""
    freed: Counter[str] = Counter()
    for numbers in batched(sorted(renders)):
        freed.update(session.scalars(select(AssetUseRow.sha256).where(AssetUseRow.render.in_(numbers))))
    uses = select(func.count()).where(AssetUseRow.sha256 == AssetRow.sha256).scalar_subquery()
    old = select(AssetRow.sha256, AssetRow.bytes, AssetRow.used_at, uses.label("uses")).where(
        AssetRow.used_at < before
    )
    found = [*session.execute(old.where(_UNUSED))]
    for names in batched(sorted(freed)):
        found += session.execute(old.where(AssetRow.sha256.in_(names)))
    unused = sorted({row for row in found if row.uses == freed[row.sha256]}, key=lambda row: row.used_at)
    return {row.sha256: row.bytes for row in unused[:most]}


# Databases bound the values in one statement.
_ROWS_AT_ONCE = 500

Item = TypeVar("Item")


def batched(items: Sequence[Item]) -> Iterator[Sequence[Item]]:
    """Split into as many as one statement may have."""
    return (items[start : start + _ROWS_AT_ONCE] for start in range(0, len(items), _ROWS_AT_ONCE))
