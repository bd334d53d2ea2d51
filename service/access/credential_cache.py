"""A cache of what the database says about keys and sessions, for a second."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from sqlalchemy.orm import Session

from service.access import keys
from service.access.principals import Principal
from service.access.secrets import digest
from service.storage.database.connection import Database

# A key that is revoked is good for so long still, seconds.
MEMORY_SECONDS = 1.0
# Answers remembered; those who try keys shall not fill the memory.
MANY = 4096

Answer = TypeVar("Answer")


class CredentialCache:
    """Asks the database for the same thing once a second at most. Used by many threads."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._answers: dict[tuple[str, str], tuple[float, object]] = {}

    def keys_made_lately(self) -> bool | None:
        """Whether a key was ever made, if that was found out a moment ago; the database is not asked."""
        at, answer = self._answers.get(("any", ""), (-MEMORY_SECONDS, None))
        return bool(answer) if time.monotonic() - at < MEMORY_SECONDS else None

    def keys_made(self) -> bool:
        """Whether a key was ever made."""
        return self._remembered("any", "", keys.any_made)

    def of_key(self, text: str) -> Principal | None:
        """Give the user of a key."""
        return self._remembered("key", digest(text), lambda session: keys.principal_of_key(session, text))

    def of_session(self, token: str) -> Principal | None:
        """Give the user of a session."""
        return self._remembered(
            "session", digest(token), lambda session: keys.principal_of_session(session, token)
        )

    def forget(self) -> None:
        """Ask again."""
        self._answers = {}

    def _remembered(self, kind: str, name: str, ask: Callable[[Session], Answer]) -> Answer:
        now = time.monotonic()
        at, answer = self._answers.get((kind, name), (-MEMORY_SECONDS, None))
        if now - at < MEMORY_SECONDS:
            return answer  # type: ignore[return-value]
        with self._database.reading() as session:
            found = ask(session)
        if len(self._answers) >= MANY:
            self._answers = {}
        self._answers[kind, name] = now, found
        return found
