"""Time limits, the only place where the clock decides: when the work on a tile has to end."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from renderer.integrator import OutOfTimeError
from renderer.math.arrays import Integers

BATCH = 32768
"""Rays of a batch: twice those of a block, as they are scattered and calls are most of their price."""

FEWEST = 256
"""Fewest rays between two readings of the clock; calls are then nearly all of their price."""

CLOCK_SECONDS = 0.1
"""Between two readings of the clock under a time limit: a fifth of how late a picture may be."""


LAST_SECONDS = 0.4e-6
"""CPU seconds a pixel for what follows the last tile: the longest decision between passes, or the picture,
its error and the layer of errors. Measured on `soft` at 1024 x 1024 with one core to itself."""

MOST_RESERVED = 0.25
"""Largest share of a time limit that is kept for the last decision."""


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """When a tile has to be finished.

    Attributes
    ----------
    until : float
        By the clock of `time.monotonic`, which the processes of one machine have in common.
    ray_seconds : float
        What a ray is expected to take.
    """

    until: float
    ray_seconds: float

    def check(self) -> None:
        """Raise `OutOfTimeError` when the time has run out."""
        if time.monotonic() >= self.until:
            raise OutOfTimeError


def reserve(limit: float, last: float) -> float:
    """Seconds before the end of a time limit at which tiles have to end.

    Parameters
    ----------
    limit : float
        Seconds; inf if there is none.
    last : float
        Seconds that forming the picture after the last tile is expected to take.
    """
    return min(last, MOST_RESERVED * limit) if np.isfinite(limit) else 0.0


def portions(rays: Integers, limit: TimeLimit | None) -> Iterator[slice]:
    """Cut a sequence of pixels with so many rays each (n,) into portions of about `BATCH` rays.

    With a limit there are fewer in a portion where rays are expensive, as the ones so far were, and the
    clock is read before each.

    Raises
    ------
    OutOfTimeError
        If the time is over.
    """
    before, start = 0, 0
    total = np.cumsum(rays)
    seconds = limit.ray_seconds if limit else 0.0
    while start < total.size:
        if limit:
            limit.check()
        begun = time.perf_counter()
        most = np.clip(CLOCK_SECONDS / seconds, FEWEST, BATCH) if limit and seconds > 0 else BATCH
        end = max(start + 1, int(np.searchsorted(total, before + most, side="right")))
        yield slice(start, end)
        seconds = (time.perf_counter() - begun) / max(int(total[end - 1]) - before, 1)
        before, start = int(total[end - 1]), end
