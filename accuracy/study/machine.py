"""On what seconds were measured."""

from __future__ import annotations

import datetime as dt
import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import TypedDict

CPU_INFO = Path("/proc/cpuinfo")

IDLE = 0.5
"""Load of a machine up to which nothing else worth telling was running."""


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
