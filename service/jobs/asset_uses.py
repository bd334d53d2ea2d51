"""Which assets are needed: those of renders, and for a while those that somebody has just sent."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from sqlalchemy import delete, exists, insert, select, update
from sqlalchemy.orm import Session

from schemas.scene import Scene
from schemas.shapes import MeshFile
from schemas.textures import ImageTexture
from service.errors import UnavailableError
from service.storage.assets import PREFIX
from service.storage.database.models import AssetRow, AssetUseRow

# Who asks for an asset again and again writes to the database no more often.
NOTED = timedelta(minutes=1)

_UNUSED = ~exists().where(AssetUseRow.sha256 == AssetRow.sha256)


def hashes_of(scene: Scene) -> set[str]:
    """Give the SHA-256 of all assets of a scene."""
    names = [texture.asset for texture in scene.textures.values() if isinstance(texture, ImageTexture)]
    names += [shape.asset for shape in scene.shapes if isinstance(shape, MeshFile)]
    return {name.removeprefix(PREFIX) for name in names}


def enter(session: Session, render: int, hashes: set[str]) -> None:
    """Keep assets for as long as a render is there.

    Raises
    ------
    UnavailableError
        If one of them has gone since the request was checked.
    """
    if known(session, hashes) != hashes:
        raise UnavailableError("An asset of the scene was removed just now. Send the request again.")
    rows = [{"render": render, "sha256": sha256} for sha256 in sorted(hashes)]
    if rows:
        session.execute(insert(AssetUseRow), rows)


def known(session: Session, hashes: set[str]) -> set[str]:
    """Give those that are there."""
    if not hashes:
        return set()
    return set(session.scalars(select(AssetRow.sha256).where(AssetRow.sha256.in_(hashes))))


def is_due(row: AssetRow) -> bool:
    """Whether it is to be noted again that somebody has asked for an asset."""
    return row.used_at < datetime.now(UTC) - NOTED


def note(session: Session, sha256: str) -> None:
    """Say that somebody has asked for an asset just now, and will probably use it."""
    session.execute(update(AssetRow).where(AssetRow.sha256 == sha256).values(used_at=datetime.now(UTC)))


def drop_unused(session: Session, before: datetime, most: int) -> dict[str, int]:
    """Forget assets that no render needs and nobody has asked for since; give them with their bytes."""
    old = select(AssetRow.sha256, AssetRow.bytes).where(_UNUSED, AssetRow.used_at < before)
    found = dict(session.execute(old.order_by(AssetRow.used_at).limit(most)).all())
    session.execute(delete(AssetRow).where(AssetRow.sha256.in_(found)))
    return found
