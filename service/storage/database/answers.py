"""Connections to PostgreSQL with a timeout for every answer.

TCP's settings detect a network that loses everything, but no server or proxy that hangs: its machine still
acknowledges what was sent.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

import psycopg
from sqlalchemy import Engine, event

from service.storage.database.urls import ANSWER_SECONDS

Waits = Generator[Any, Any, Any]


class Connection(psycopg.Connection[Any]):
    """Fails where an answer takes longer than ``answer_seconds``, and is closed afterwards."""

    answer_seconds = ANSWER_SECONDS

    def wait(self, gen: Waits, *rest: Any, **more: Any) -> Any:
        """Wait for the server's answer.

        Raises
        ------
        psycopg.OperationalError
            If it does not come in time.
        """
        return super().wait(self._limited(gen), *rest, **more)

    def _limited(self, gen: Waits) -> Waits:
        deadline = time.monotonic() + self.answer_seconds
        try:
            wanted = next(gen)
            while True:
                ready = yield wanted
                if not ready and time.monotonic() > deadline:
                    self.pgconn.finish()
                    message = f"The database has not answered for {self.answer_seconds:g} seconds."
                    raise psycopg.OperationalError(message)
                wanted = gen.send(ready)
        except StopIteration as ended:
            return ended.value


def limit(engine: Engine) -> None:
    """Have an engine make connections of this kind."""

    @event.listens_for(engine, "do_connect")
    def connect(_dialect: Any, _record: Any, words: list[Any], options: dict[str, Any]) -> Connection:
        return Connection.connect(*words, **options)
