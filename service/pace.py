"""How fast the queue gets shorter."""

from __future__ import annotations

import math
import threading
import time


class Pace:
    """CPU seconds rendered in a second of the clock, of late. Written by one thread, read by many.

    Parameters
    ----------
    workers : int
        Their number is the rate until one is measured.
    """

    # Work of a minute ago counts 1/e of work done now.
    MEMORY_SECONDS = 60.0

    def __init__(self, workers: int) -> None:
        self._lock = threading.Lock()
        self._workers = workers
        self._begun = self._last = time.monotonic()
        self._sum = 0.0

    def note(self, cpu_seconds: float) -> None:
        """Take note of finished work."""
        now = time.monotonic()
        with self._lock:
            self._sum = self._sum * math.exp((self._last - now) / self.MEMORY_SECONDS) + cpu_seconds
            self._last = now

    def rate(self) -> float:
        """Give the mean of the last minute; where there is little to go by, what the workers could do."""
        now = time.monotonic()
        with self._lock:
            recent = self._sum * math.exp((self._last - now) / self.MEMORY_SECONDS)
            watched = self.MEMORY_SECONDS * -math.expm1((self._begun - now) / self.MEMORY_SECONDS)
        # As if the workers had been busy for a second before.
        return (recent + self._workers) / (watched + 1.0)
