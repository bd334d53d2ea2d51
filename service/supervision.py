"""Supervised threads: after an error their work is restarted, or the process ends."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress

import structlog

FIRST_WAIT_SECONDS = 0.5
"""Wait before the second try; each further one is twice as long, up to the next line."""
LONGEST_WAIT_SECONDS = 10.0
"""Longest wait: a try costs next to nothing."""
FAILING_SECONDS = 10.0
"""Errors for so long make a service not ready, as for a database that cannot be written."""

log = structlog.get_logger()


class SupervisedThread:
    """A thread whose work begins again after an error, with a growing wait, until it returns.

    Parameters
    ----------
    name : str
        Of the thread, in the log too.
    work : callable
        Runs until ``stopping`` is set, and calls `note_success` whenever something is done.
    expected : tuple of type, optional
        Errors from outside of the service: only their kind is logged, without a traceback.
    most_failures : int, optional
        After so many errors in a row the process ends with ``os.EX_SOFTWARE``, so that its supervisor
        restarts it: nothing is lost, and jobs are not left with a service that cannot work. By default the
        work is retried for ever.

    Attributes
    ----------
    stopping : threading.Event
        Whether the work is to end.
    failures : int
        Errors in a row.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[], None],
        *,
        expected: tuple[type[Exception], ...] = (),
        most_failures: int | None = None,
    ) -> None:
        self.stopping = threading.Event()
        self._name, self._work = name, work
        self._expected, self._most_failures = expected, most_failures
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._failing_since: float | None = None
        self.note_success()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the work, and wait for its end."""
        self.stopping.set()
        if self._thread.is_alive():
            self._thread.join()

    def is_alive(self) -> bool:
        """Whether it was started and has not ended."""
        return self._thread.is_alive()

    def is_failing(self) -> bool:
        """Whether it does not run, or has had nothing but errors for a while."""
        since = self._failing_since
        return not self.is_alive() or (since is not None and time.monotonic() - since > FAILING_SECONDS)

    def note_success(self) -> None:
        """Record that the work does what it should."""
        self.failures, self._wait_seconds, self._failing_since = 0, FIRST_WAIT_SECONDS, None

    def note_failure(self) -> None:
        """Record an error that the work itself deals with."""
        if self._failing_since is None:
            self._failing_since = time.monotonic()

    def _run(self) -> None:
        while not self.stopping.is_set():
            try:
                self._work()
            except Exception as error:  # noqa: BLE001  (whatever it is, the thread goes on)
                self.note_failure()
                self.failures += 1
                self._report(error)
                self.stopping.wait(self._wait_seconds)
                self._wait_seconds = min(2.0 * self._wait_seconds, LONGEST_WAIT_SECONDS)
            else:
                return

    def _report(self, error: Exception) -> None:
        """Log an error; end the process where it was one too many."""
        final = self._most_failures is not None and self.failures >= self._most_failures
        # Where logs go to a full disk, that is no reason to stop.
        with suppress(OSError):
            if isinstance(error, self._expected):
                log.warning("thread failed; retrying", thread=self._name, error=type(error).__name__)
            else:
                event = "thread failed; exiting" if final else "thread failed; retrying"
                log.error(event, thread=self._name, exc_info=error)
        if final:
            os._exit(os.EX_SOFTWARE)
