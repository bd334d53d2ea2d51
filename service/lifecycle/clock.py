"""Time that has passed since a moment that was written down, whatever is done to the wall clock meanwhile.

A moment in the database is one of the wall clock, which an operator or NTP may set forward or back at any
time. Limits count seconds that have passed, so each moment is tied to a clock that only goes forward: when
it is taken, or, after a restart, when it is seen first.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from datetime import UTC, datetime

# Moments that are remembered: more than there are renders that run at the same time.
MANY = 65_536


def _wall() -> datetime:
    return datetime.now(UTC)


class Clock:
    """Moments of the wall clock, and what a steady clock showed then.

    Parameters
    ----------
    wall, steady
        The clocks; the steady one counts seconds from some beginning.
    """

    def __init__(
        self, wall: Callable[[], datetime] = _wall, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self._wall, self._steady = wall, steady
        self._lock = threading.Lock()
        self._known: OrderedDict[datetime, float] = OrderedDict()

    def now(self) -> datetime:
        """Take a moment to be written down."""
        moment = self._wall()
        self.since(moment)
        return moment

    def since(self, moment: datetime) -> float:
        """Give the seconds that have passed since then; never less than 0."""
        with self._lock:
            now = self._steady()
            if moment not in self._known:
                self._known[moment] = now - max(0.0, (self._wall() - moment).total_seconds())
            self._known.move_to_end(moment)
            if len(self._known) > MANY:
                self._known.popitem(last=False)
            return now - self._known[moment]


_clock = Clock()
now, since = _clock.now, _clock.since
