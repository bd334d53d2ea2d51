"""Deadlines of pilots: work is divided into small units, and none begins that might end too late."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Self, TypeVar

from renderer.adaptive.time_limits import TimeLimit
from renderer.integrator import OutOfTimeError

Result = TypeVar("Result")

WALL_RATIO = 4.0
"""Wall-clock seconds that a pilot may take per CPU second: with three others on one processor it still gets
all its CPU time, and a client waits only seconds."""


@dataclass(frozen=True, slots=True)
class Deadline(TimeLimit):
    """A deadline for work of this thread, in CPU seconds, so that other work does not shorten it.

    Attributes
    ----------
    end : float
        On the clock of `time.thread_time`, seconds; `until` ends it in any case, in wall-clock time.
    """

    end: float = math.inf

    @classmethod
    def after(cls, seconds: float) -> Self:
        """A deadline after so many CPU seconds of this thread."""
        return cls(time.monotonic() + WALL_RATIO * seconds, 0.0, time.thread_time() + seconds)

    @property
    def left(self) -> float:
        """CPU seconds left, below 0 after the deadline."""
        return min(self.end - time.thread_time(), self.until - time.monotonic())

    def check(self) -> None:
        """Raise `OutOfTimeError` when the time has run out."""
        if self.left <= 0:
            raise OutOfTimeError

    def part(self, share: float) -> "Deadline":
        """An earlier deadline, after a share of the time that is left."""
        return Deadline(self.until, self.ray_seconds, time.thread_time() + max(self.left, 0.0) * share)


def within(deadline: Deadline, units: Iterable[Callable[[], Result]], first: float = 0.0) -> Iterator[Result]:
    """Yield the results of units of work until the next one might end too late.

    Parameters
    ----------
    deadline : Deadline
    units : iterable of callable
        Of similar length: each is expected to take as long as the longest so far.
    first : float
        Expected seconds of the first one.
    """
    longest = first
    for unit in units:
        left = deadline.left
        if longest > left:
            return
        result = unit()
        longest = max(longest, left - deadline.left)
        yield result
