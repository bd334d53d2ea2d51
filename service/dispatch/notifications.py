"""Notifications between the servers on one database: there is work, jobs have changed.

As within one server, the database is the truth, and a notification only says that it has changed. After a
lost connection everything is read once, for notifications may have been missed.
"""

from __future__ import annotations

import threading
from typing import Any

import structlog

from service.dispatch.dispatcher import Dispatcher
from service.dispatch.job_events import JobEvents
from service.storage.database.connection import Database

# Seconds before the next try to listen.
RETRY_SECONDS = 0.5

log = structlog.get_logger()


class NotificationListener:
    """Listens to the other servers, in a thread of its own, where the database is shared.

    Parameters
    ----------
    database, dispatcher, job_events
        Those of this server; what others send goes to the last two.
    """

    def __init__(self, database: Database, dispatcher: Dispatcher, job_events: JobEvents) -> None:
        self._database, self._dispatcher, self._job_events = database, dispatcher, job_events
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifications", daemon=True)

    def start(self) -> None:
        """Begin to listen."""
        if self._database.shared:
            self._thread.start()

    def stop(self) -> None:
        """Stop listening."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                for notice in self._database.notices(self._stopping):
                    self._act(notice)
            except self._database.errors as error:
                log.warning("notifications lost, trying again", error=type(error).__name__)
                self._stopping.wait(RETRY_SECONDS)

    def _act(self, notice: dict[str, Any]) -> None:
        if "jobs" in notice:
            self._job_events.publish(notice["jobs"])
        else:
            if "work" not in notice:
                self._job_events.publish_all()
            self._dispatcher.wake()
