"""Processors available to this process; cheap to import, because settings need it."""

import os


def usable_processors() -> int:
    """Count the processors of this process: a container may have fewer than the machine.

    Only Linux reports that; elsewhere all of the machine count.
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
