"""Notifications between the servers on one database: there is work, jobs have changed.

The database is the truth, and a notification only says that it has changed. After a lost connection
everything is read once, since notifications may have been missed, and repeatedly until the connection is
restored.
"""

from __future__ import annotations

from typing import Any

import structlog
from sqlalchemy.exc import SQLAlchemyError

from service.dispatch.dispatcher import Dispatcher
from service.dispatch.job_events import JobEvents
from service.storage.database.connection import Database
from service.supervision import SupervisedThread

# Seconds before the next try to listen.
RETRY_SECONDS = 0.5

log = structlog.get_logger()


class NotificationListener:
    """Listens to the other servers, in a thread of its own, where the database is shared.

    Parameters
    ----------
    database, dispatcher, job_events
        Those of this server; notifications of others go to the last two.
    """

    def __init__(self, database: Database, dispatcher: Dispatcher, job_events: JobEvents) -> None:
        self._database, self._dispatcher, self._job_events = database, dispatcher, job_events
        self._thread = SupervisedThread("notifications", self._run)

    def start(self) -> None:
        """Begin to listen."""
        if self._database.shared:
            self._thread.start()

    def stop(self) -> None:
        """Stop listening."""
        self._thread.stop()

    def _run(self) -> None:
        stopping = self._thread.stopping
        while not stopping.is_set():
            try:
                for notice in self._database.notices(stopping):
                    self._act(notice)
                    self._thread.note_success()
            except self._database.errors as error:
                log.warning("notifications lost; reconnecting", error=type(error).__name__)
                self._poll()
                stopping.wait(RETRY_SECONDS)

    def _poll(self) -> None:
        """Have everything read, unless the database is unreachable: watchers need not notice that."""
        try:
            with self._database.reading() as session:
                session.connection()
        except SQLAlchemyError:
            return
        self._act({})

    def _act(self, notice: dict[str, Any]) -> None:
        if "jobs" in notice:
            self._job_events.publish(notice["jobs"])
        else:
            if "work" not in notice:
                self._job_events.publish_all()
            self._dispatcher.wake()
