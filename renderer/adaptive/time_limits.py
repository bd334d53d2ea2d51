"""Time limits: the only code in which the clock decides."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

import numpy as np

from renderer.integrator import OutOfTimeError
from renderer.math.arrays import Integers

BATCH_RAYS = 32768
"""Rays of a batch: twice those of a block, as they are scattered and calls dominate their cost."""

MIN_BATCH_RAYS = 256
"""Least rays between two readings of the clock; calls are then nearly all of their cost."""

CLOCK_SECONDS = 0.1
"""Seconds between two readings of the clock: a fifth of how late a picture may be."""


LAST_SECONDS = 0.4e-6
"""CPU seconds a pixel after the last tile: the longest decision between passes, or the picture with its error
and the layer of errors. Measured on `soft` at 1024 x 1024 with one core to itself."""

MAX_RESERVED_SHARE = 0.25
"""Largest share of a time limit that is reserved for the last decision."""


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """Deadline of a tile; by default there is none.

    Attributes
    ----------
    until : float
        By `time.monotonic`, which the processes of a machine share.
    ray_seconds : float
        Expected CPU seconds of a ray.
    """

    until: float = inf
    ray_seconds: float = 0.0

    def check(self) -> None:
        """Raise `OutOfTimeError` when the time has run out."""
        if time.monotonic() >= self.until:
            raise OutOfTimeError


NO_LIMIT = TimeLimit()


def reserve(limit: float, last: float) -> float:
    """Seconds between the end of the tiles and the end of a time limit.

    Parameters
    ----------
    limit : float
        Seconds; inf if there is none.
    last : float
        Expected seconds of forming the picture after the last tile.
    """
    return min(last, MAX_RESERVED_SHARE * limit) if np.isfinite(limit) else 0.0


def portions(rays: Integers, limit: TimeLimit) -> Iterator[slice]:
    """Cut a sequence of pixels with numbers of rays (n,) into portions of about `BATCH_RAYS` rays.

    With a deadline, portions are smaller where rays have been expensive so far, and the clock is read before
    each.

    Raises
    ------
    OutOfTimeError
        If the time is over.
    """
    before, start = 0, 0
    total = np.cumsum(rays)
    seconds, is_limited = limit.ray_seconds, limit.until < inf
    while start < total.size:
        limit.check()
        begun = time.perf_counter()
        most = BATCH_RAYS
        if is_limited and seconds > 0:
            most = int(np.clip(CLOCK_SECONDS / seconds, MIN_BATCH_RAYS, BATCH_RAYS))
        end = max(start + 1, int(np.searchsorted(total, before + most, side="right")))
        yield slice(start, end)
        seconds = (time.perf_counter() - begun) / max(int(total[end - 1]) - before, 1)
        before, start = int(total[end - 1]), end
