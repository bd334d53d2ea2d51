"""API keys and sessions in the database."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from sqlalchemy import delete, exists, select
from sqlalchemy.orm import Session

from schemas.access import Role
from service.access import secrets
from service.access.principals import Principal
from service.access.secrets import Key
from service.storage.database.models import KeyRow, SessionRow

NOBODYS = "0" * 64
"""A digest that no secret has."""
SESSION_LIFE = timedelta(hours=12)


def add(
    session: Session,
    user: str,
    role: Role,
    *,
    max_jobs: int | None = None,
    max_cpu_seconds: float | None = None,
) -> Key:
    """Enter a key for a user, and return it: nobody will ever see it again."""
    key = secrets.new_key()
    row = KeyRow(
        id=key.id,
        secret_sha256=secrets.digest(key.secret),
        user=user,
        role=role.value,
        max_jobs=max_jobs,
        max_cpu_seconds=max_cpu_seconds,
        created_at=datetime.now(UTC),
    )
    session.add(row)
    return key


def listing(session: Session) -> list[KeyRow]:
    """Give all keys, the revoked ones too, in the order of their users."""
    return list(session.scalars(select(KeyRow).order_by(KeyRow.user, KeyRow.created_at)))


def revoke(session: Session, key_id: str) -> bool:
    """End a key and the sessions begun with it; False if there is none of this name."""
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
    """Give the user of a key; None if it is nobody's, or revoked."""
    key = secrets.read_key(text)
    row = session.get(KeyRow, key.id) if key else None
    if key is None:
        return None
    # An unknown name costs what a wrong secret does.
    good = secrets.same(row.secret_sha256 if row else NOBODYS, key.secret)
    return _principal(row) if row and good else None


def begin_session(session: Session, key: Key) -> str:
    """Enter a session, and return its token."""
    now, token = datetime.now(UTC), secrets.new_token()
    session.execute(delete(SessionRow).where(SessionRow.expires_at < now))
    session.add(SessionRow(token_sha256=secrets.digest(token), key=key.id, expires_at=now + SESSION_LIFE))
    return token


def principal_of_session(session: Session, token: str) -> Principal | None:
    """Give the user of a session; None if there is none, or not any more."""
    row = session.get(SessionRow, secrets.digest(token))
    if row is None or row.expires_at < datetime.now(UTC):
        return None
    key = session.get(KeyRow, row.key)
    return _principal(key) if key else None


def end_session(session: Session, token: str) -> None:
    """Forget a session."""
    session.execute(delete(SessionRow).where(SessionRow.token_sha256 == secrets.digest(token)))


def _principal(row: KeyRow) -> Principal | None:
    if row.revoked_at is not None:
        return None
    return Principal(row.user, Role(row.role), row.max_jobs, row.max_cpu_seconds)
