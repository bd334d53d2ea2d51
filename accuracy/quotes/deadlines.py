"""Deadlines of pilots: work is cut into small units, and none begins that might not be finished."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Self, TypeVar

from renderer.adaptive.time_limits import TimeLimit
from renderer.integrator import OutOfTimeError

Result = TypeVar("Result")

WALL_RATIO = 4.0
"""Seconds by the clock that a pilot may take for each CPU second: beside three others on one processor it
still has all its time, and a client waits for seconds at most."""


@dataclass(frozen=True, slots=True)
class Deadline(TimeLimit):
    """A time by which work of this thread has to be done, in CPU seconds: other work does not shorten it.

    Attributes
    ----------
    end : float
        By the clock of `time.thread_time`, seconds; `until` is the latest, however little of the processor
        there was.
    """

    end: float = math.inf

    @classmethod
    def after(cls, seconds: float) -> Self:
        """After so many CPU seconds of this thread."""
        return cls(time.monotonic() + WALL_RATIO * seconds, 0.0, time.thread_time() + seconds)

    @property
    def left(self) -> float:
        """CPU seconds until then, below 0 once it is over."""
        return min(self.end - time.thread_time(), self.until - time.monotonic())

    def check(self) -> None:
        """Raise `OutOfTimeError` when the time has run out."""
        if self.left <= 0:
            raise OutOfTimeError

    def part(self, share: float) -> "Deadline":
        """An earlier deadline, after a share of the time that is left."""
        return Deadline(self.until, self.ray_seconds, time.thread_time() + max(self.left, 0.0) * share)


def within(deadline: Deadline, units: Iterable[Callable[[], Result]], first: float = 0.0) -> Iterator[Result]:
    """Do units of work and give their results, until the next one might end too late.

    Parameters
    ----------
    deadline : Deadline
    units : iterable of callable
        Much alike: each is taken to last as long as the longest so far.
    first : float
        Seconds that the first one is taken to last.
    """
    longest = first
    for unit in units:
        left = deadline.left
        if longest > left:
            return
        result = unit()
        longest = max(longest, left - deadline.left)
        yield result
