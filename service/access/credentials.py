"""A short-lived cache of keys and sessions, which also records when each key was last used."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import TypeVar

from sqlalchemy import update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from service.access.keys import any_made, digest, principal_of_key, principal_of_session
from service.access.principals import Principal
from service.errors import KeyExpiredError
from service.storage.database.connection import Database
from service.storage.database.models import KeyRow
from service.supervision import SupervisedThread

# A revoked key is accepted for at most this long, seconds.
CACHE_SECONDS = 1.0
# Most cached answers, so that guessed keys do not fill the memory.
MOST_CACHED = 4096
# Uses are written in batches, so that no request waits for the lock of the database.
USE_SECONDS = 60.0

Answer = TypeVar("Answer")


class CredentialCache:
    """Caches keys and sessions of the database for a second. Thread-safe."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._answers: dict[tuple[str, str], tuple[float, object]] = {}
        self._used: dict[str, datetime] = {}
        self._thread = SupervisedThread("key uses", self._run, expected=(SQLAlchemyError,))

    def start(self) -> None:
        """Begin to write uses."""
        self._thread.start()

    def stop(self) -> None:
        """Write the last uses, if the database can be written, and stop."""
        self._thread.stop()
        with suppress(SQLAlchemyError):
            self.write_uses()

    def cached_keys_made(self) -> bool | None:
        """Whether a key was ever created, only from the cache; None if that is not cached."""
        at, answer = self._answers.get(("any", ""), (-CACHE_SECONDS, None))
        return bool(answer) if time.monotonic() - at < CACHE_SECONDS else None

    def keys_made(self) -> bool:
        """Whether a key was ever made."""
        return self._cached("any", "", any_made)

    def of_key(self, text: str) -> Principal | None:
        """Return the user of a key.

        Raises
        ------
        KeyExpiredError
            If it was valid once.
        """
        return self._used_now(
            self._cached("key", digest(text), lambda session: principal_of_key(session, text))
        )

    def of_session(self, token: str) -> Principal | None:
        """Return the user of a session; errors are those of `of_key`."""
        return self._used_now(
            self._cached("session", digest(token), lambda session: principal_of_session(session, token))
        )

    def clear(self) -> None:
        """Forget all answers."""
        self._answers = {}

    def write_uses(self) -> None:
        """Write when keys were used since the last time, in one transaction."""
        used, self._used = self._used, {}
        if used:
            rows = [{"id": key, "last_used_at": at} for key, at in used.copy().items()]
            with self._database.writing() as session:
                session.execute(update(KeyRow), rows)

    def _used_now(self, principal: Principal | None) -> Principal | None:
        if principal is not None and principal.key is not None:
            now = datetime.now(UTC)
            if principal.expires_at is not None and principal.expires_at <= now:
                raise KeyExpiredError(principal.expires_at)
            self._used[principal.key] = now
        return principal

    def _run(self) -> None:
        while not self._thread.stopping.wait(USE_SECONDS):
            self.write_uses()
            self._thread.note_success()

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
