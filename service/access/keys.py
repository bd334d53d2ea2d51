"""API keys and browser sessions: secrets, their rows in the database, and a short-lived cache of both.

Keys and tokens are 256 random bits. A fast hash is right for them: slow ones are for words that people
choose, which can be guessed; these cannot.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import NamedTuple, TypeVar

from sqlalchemy import delete, exists, select
from sqlalchemy.orm import Session

from schemas.api.administration import Role
from service.access.principals import Principal
from service.storage.database.connection import Database
from service.storage.database.models import KeyRow, SessionRow

BYTES = 32
KEY = re.compile(r"pnm_([0-9a-f]{12})_([A-Za-z0-9_-]{43})", re.ASCII)
UNMATCHED = "0" * 64
"""A digest that no secret has."""
SESSION_LIFE = timedelta(hours=12)
# A revoked key is accepted for at most this long, seconds.
CACHE_SECONDS = 1.0
# Most cached answers, so that guessed keys do not fill the memory.
MOST_CACHED = 4096

Answer = TypeVar("Answer")


class Key(NamedTuple):
    """The two parts of an API key: a public name and a secret."""

    id: str
    secret: str

    def __str__(self) -> str:
        return f"pnm_{self.id}_{self.secret}"


def new_token() -> str:
    """Make a secret."""
    return secrets.token_urlsafe(BYTES)


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


def add(
    session: Session,
    user: str,
    role: Role,
    *,
    max_jobs: int | None = None,
    max_cpu_seconds: float | None = None,
) -> Key:
    """Create a key for a user and return it: its secret cannot be read again."""
    key = Key(secrets.token_hex(6), new_token())
    row = KeyRow(
        id=key.id,
        secret_sha256=digest(key.secret),
        user=user,
        role=role.value,
        max_jobs=max_jobs,
        max_cpu_seconds=max_cpu_seconds,
        created_at=datetime.now(UTC),
    )
    session.add(row)
    return key


def listing(session: Session) -> list[KeyRow]:
    """List all keys, revoked ones included, in the order of their users."""
    return list(session.scalars(select(KeyRow).order_by(KeyRow.user, KeyRow.created_at)))


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
    return Principal(row.user, Role(row.role), row.max_jobs, row.max_cpu_seconds)


class CredentialCache:
    """Remembers for a second what the database says about keys and sessions. Used by many threads."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._answers: dict[tuple[str, str], tuple[float, object]] = {}

    def cached_keys_made(self) -> bool | None:
        """Whether a key was ever made, without asking the database; None if that is not cached."""
        at, answer = self._answers.get(("any", ""), (-CACHE_SECONDS, None))
        return bool(answer) if time.monotonic() - at < CACHE_SECONDS else None

    def keys_made(self) -> bool:
        """Whether a key was ever made."""
        return self._cached("any", "", any_made)

    def of_key(self, text: str) -> Principal | None:
        """Return the user of a key."""
        return self._cached("key", digest(text), lambda session: principal_of_key(session, text))

    def of_session(self, token: str) -> Principal | None:
        """Return the user of a session."""
        return self._cached("session", digest(token), lambda session: principal_of_session(session, token))

    def clear(self) -> None:
        """Forget all answers."""
        self._answers = {}

    def _cached(self, kind: str, name: str, ask: Callable[[Session], Answer]) -> Answer:
        now = time.monotonic()
        at, answer = self._answers.get((kind, name), (-CACHE_SECONDS, None))
        if now - at < CACHE_SECONDS:
            return answer  # type: ignore[return-value]
        with self._database.reading() as session:
            found = ask(session)
        if len(self._answers) >= MOST_CACHED:
            self._answers = {}
        self._answers[kind, name] = now, found
        return found
