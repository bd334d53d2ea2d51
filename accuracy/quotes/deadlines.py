"""A pilot has little time: it is cut into small units of work, and none begins that might not be finished."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Deadline:
    """A time by which work has to be done.

    Attributes
    ----------
    end : float
        By the clock of `time.monotonic`, seconds.
    """

    end: float

    @classmethod
    def after(cls, seconds: float) -> "Deadline":
        """So many seconds from now."""
        return cls(time.monotonic() + seconds)

    @property
    def left(self) -> float:
        """Seconds until then, below 0 once it is over."""
        return self.end - time.monotonic()

    def part(self, share: float) -> "Deadline":
        """An earlier deadline, after a share of the time that is left."""
        return Deadline.after(max(self.left, 0.0) * share)


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
        begun = time.monotonic()
        if begun + longest > deadline.end:
            return
        result = unit()
        longest = max(longest, time.monotonic() - begun)
        yield result
