"""The throughput of the queue."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable


class Throughput:
    """CPU seconds rendered per second of wall time, recently. Written by one thread, read by many.

    Only the time in which workers are busy counts: an idle service is not slow.

    Parameters
    ----------
    workers : int
        Their number is the rate until one is measured.
    clock : callable
        Gives seconds.
    """

    # Work of a minute ago counts 1/e of work done now.
    MEMORY_SECONDS = 60.0

    def __init__(self, workers: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._lock = threading.Lock()
        self._workers, self._clock = workers, clock
        self._busy, self._last = False, clock()
        self._sum = self._seconds = 0.0

    def watch(self, *, busy: bool) -> None:
        """Record whether workers are busy from now on."""
        with self._lock:
            self._advance()
            self._busy = busy

    def note(self, cpu_seconds: float) -> None:
        """Record finished work."""
        with self._lock:
            self._advance()
            self._sum += cpu_seconds

    def rate(self) -> float:
        """Return the mean of the last busy minute, or with little data the capacity of the workers."""
        with self._lock:
            self._advance()
            # As if the workers had been busy for a second before.
            return (self._sum + self._workers) / (self._seconds + 1.0)

    def _advance(self) -> None:
        """Decay the counted work, and the seconds it took, by the busy time since the last call."""
        now = self._clock()
        passed, self._last = (now - self._last if self._busy else 0.0), now
        fading = math.exp(-passed / self.MEMORY_SECONDS)
        self._sum *= fading
        self._seconds = self._seconds * fading + self.MEMORY_SECONDS * (1.0 - fading)
