"""On what the figures were measured, and how CPU time is counted."""

from __future__ import annotations

import datetime as dt
import os
import platform
import resource
import statistics
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

if TYPE_CHECKING:
    from collections.abc import Sequence

CPU_INFO = Path("/proc/cpuinfo")


class Machine(TypedDict):
    """What a figure depends on beside the code.

    `load` is the number of runnable processes, averaged over the minute before: above a few tenths, somebody
    else was using the machine and the times are too long.
    """

    date: str
    cpu: str
    cores: int
    load: float
    system: str
    python: str
    numpy: str
    penumbra: str


def describe() -> Machine:
    """Describe this machine as it is now."""
    return Machine(
        date=dt.datetime.now(tz=dt.UTC).isoformat(timespec="seconds"),
        cpu=_cpu(),
        cores=len(os.sched_getaffinity(0)),
        load=round(os.getloadavg()[0], 2),
        system=platform.platform(aliased=True, terse=True),
        python=platform.python_version(),
        numpy=version("numpy"),
        penumbra=version("penumbra-render"),
    )


def _cpu() -> str:
    lines = CPU_INFO.read_text().splitlines() if CPU_INFO.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def cpu_seconds() -> float:
    """User and system time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


class Spread(TypedDict):
    """Several runs of the same thing, in seconds."""

    median: float
    least: float
    most: float
    runs: int


def spread(seconds: Sequence[float]) -> Spread:
    """Summarise several runs.

    Examples
    --------
    >>> spread([3.0, 1.0, 2.0])
    {'median': 2.0, 'least': 1.0, 'most': 3.0, 'runs': 3}
    """
    return Spread(
        median=round(statistics.median(seconds), 4),
        least=round(min(seconds), 4),
        most=round(max(seconds), 4),
        runs=len(seconds),
    )
