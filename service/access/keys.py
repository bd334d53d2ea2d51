"""API keys and browser sessions: secrets, and their rows in the database.

Keys and tokens are 256 random bits, which cannot be guessed, so a fast hash suffices: slow ones protect
passwords.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import RowMapping, and_, delete, exists, or_, select
from sqlalchemy.orm import Session

from schemas.api.administration import Role
from service.access.principals import Principal
from service.storage.database.models import KeyRow, SessionRow

SECRET_BYTES = 32
KEY = re.compile(r"pnm_([0-9a-f]{12})_([A-Za-z0-9_-]{43})", re.ASCII)
UNMATCHED = "0" * 64
"""Compared with for unknown keys; no secret has this digest."""
SESSION_LIFE = timedelta(hours=12)


class Key(NamedTuple):
    """The two parts of an API key: a public name and a secret."""

    id: str
    secret: str

    def __str__(self) -> str:
        return f"pnm_{self.id}_{self.secret}"


def new_token() -> str:
    """Make a secret."""
    return secrets.token_urlsafe(SECRET_BYTES)


def read_key(text: str) -> Key | None:
    """Parse a key; None if the text is not one.

    >>> read_key(f"pnm_0123456789ab_{'x' * 43}").id
    '0123456789ab'
    >>> read_key("let me in")
    """
    found = KEY.fullmatch(text)
    return Key(*found.groups()) if found else None


def digest(secret: str) -> str:
    """Hash a secret for storage."""
    return hashlib.sha256(secret.encode()).hexdigest()


def new_key(user: str, role: Role, **limits: Any) -> tuple[Key, dict[str, Any]]:
    """Make a key for a user, and the values of its row, from which the secret cannot be read.

    Parameters
    ----------
    limits
        ``max_jobs``, ``max_cpu_seconds`` and ``expires_at``.
    """
    key = Key(secrets.token_hex(6), new_token())
    values = {"id": key.id, "secret_sha256": digest(key.secret), "user": user, "role": role.value}
    return key, values | {"created_at": datetime.now(UTC)} | limits


def add(session: Session, user: str, role: Role, **limits: Any) -> Key:
    """Create a key for a user, with limits as for `new_key`, and return it."""
    key, values = new_key(user, role, **limits)
    session.add(KeyRow(**values))
    return key


def listing(session: Session) -> list[KeyRow]:
    """List all keys, revoked ones included, in the order of their users."""
    return list(session.scalars(select(KeyRow).order_by(KeyRow.user, KeyRow.created_at)))


def page(session: Session, limit: int, after: str | None) -> Sequence[KeyRow]:
    """Return the keys after the one with this id, at most ``limit``, in the order of their users."""
    query = select(KeyRow).order_by(KeyRow.user, KeyRow.id).limit(limit)
    last = session.get(KeyRow, after) if after else None
    if last is not None:
        query = query.where(or_(KeyRow.user > last.user, and_(KeyRow.user == last.user, KeyRow.id > last.id)))
    return session.scalars(query).all()


def valid(session: Session) -> Sequence[RowMapping]:
    """Return user, role, id and end of the keys that are neither revoked nor expired."""
    lasting = or_(KeyRow.expires_at.is_(None), KeyRow.expires_at > datetime.now(UTC))
    query = select(KeyRow.user, KeyRow.role, KeyRow.id, KeyRow.expires_at)
    return session.execute(query.where(KeyRow.revoked_at.is_(None), lasting)).mappings().all()


def revoke(session: Session, key_id: str) -> bool:
    """End a key and the sessions begun with it; False if no key has this name."""
    row = session.get(KeyRow, key_id)
    if row is None:
        return False
    row.revoked_at = row.revoked_at or datetime.now(UTC)
    session.execute(delete(SessionRow).where(SessionRow.key == key_id))
    return True


def any_made(session: Session) -> bool:
    """Whether a key was ever made: revoking the last one does not switch authentication off."""
    return bool(session.scalar(select(exists().where(KeyRow.id.is_not(None)))))


def principal_of_key(session: Session, text: str) -> Principal | None:
    """Return the user of a key; None if it is unknown or revoked."""
    key = read_key(text)
    row = session.get(KeyRow, key.id) if key else None
    if key is None:
        return None
    # In constant time, and an unknown name costs as much as a wrong secret.
    is_good = hmac.compare_digest(row.secret_sha256 if row else UNMATCHED, digest(key.secret))
    return _principal(row) if row and is_good else None


def begin_session(session: Session, key: Key) -> str:
    """Create a session and return its token."""
    now, token = datetime.now(UTC), new_token()
    session.execute(delete(SessionRow).where(SessionRow.expires_at < now))
    session.add(SessionRow(token_sha256=digest(token), key=key.id, expires_at=now + SESSION_LIFE))
    return token


def principal_of_session(session: Session, token: str) -> Principal | None:
    """Return the user of a session; None if it is unknown or expired."""
    row = session.get(SessionRow, digest(token))
    if row is None or row.expires_at < datetime.now(UTC):
        return None
    key = session.get(KeyRow, row.key)
    return _principal(key) if key else None


def end_session(session: Session, token: str) -> None:
    """Delete a session."""
    session.execute(delete(SessionRow).where(SessionRow.token_sha256 == digest(token)))


def _principal(row: KeyRow) -> Principal | None:
    if row.revoked_at is not None:
        return None
    return Principal(
        row.user,
        Role(row.role),
        row.max_jobs,
        row.max_cpu_seconds,
        key=row.id,
        expires_at=row.expires_at,
    )
