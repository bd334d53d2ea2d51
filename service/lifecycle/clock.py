"""Seconds since a stored time, independent of changes to the wall clock.

Times in the database are those of the wall clock, which an operator or NTP may change. Limits count elapsed
seconds, so each time is tied to a monotonic clock when it is taken, or first read after a restart.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from datetime import UTC, datetime

# Most cached times, more than renders run at the same time.
KEPT_CLOCKS = 65_536


def wall() -> datetime:
    """Return the time of the wall clock."""
    return datetime.now(UTC)


class Clock:
    """Times of the wall clock, each with the time of a monotonic clock.

    Parameters
    ----------
    wall, steady
        The clocks; the steady one counts seconds from some beginning.
    """

    def __init__(
        self, wall: Callable[[], datetime] = wall, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self._wall, self._steady = wall, steady
        self._lock = threading.Lock()
        self._known: OrderedDict[datetime, float] = OrderedDict()

    def now(self) -> datetime:
        """Take the time, to be stored."""
        taken = self._wall()
        self.since(taken)
        return taken

    def since(self, taken: datetime) -> float:
        """Return the seconds that have passed since then; never less than 0."""
        with self._lock:
            now = self._steady()
            if taken not in self._known:
                self._known[taken] = now - max(0.0, (self._wall() - taken).total_seconds())
            self._known.move_to_end(taken)
            if len(self._known) > KEPT_CLOCKS:
                self._known.popitem(last=False)
            return now - self._known[taken]


_clock = Clock()
now, since = _clock.now, _clock.since
