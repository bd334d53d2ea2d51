"""Heartbeats: a worker sends them through a pipe, and its parent measures time by them.

No clock is read, so a suspended machine, a service that was stopped for an hour, and a changed wall clock
have no effect: no worker counts as silent meanwhile, and no task as running.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import NamedTuple

SLICE_SECONDS = 2.0
"""Length of a time slice, seconds. Users take turns: a new one waits for one slice, or for two if a second
task waits at each worker. Storing and reading an unfinished tile takes some 10 ms."""

# Bytes of beats that are read at once.
READ_BYTES = 4096


@dataclass(frozen=True)
class Lease:
    """Timeouts of a worker.

    Attributes
    ----------
    start_seconds
        Until it reports its start, after importing the renderer.
    silent_seconds
        Without a sign of life after that.
    task_seconds
        At one task.
    slice_seconds
        At one tile before it is preempted.
    """

    start_seconds: float = 120.0
    silent_seconds: float = 30.0
    task_seconds: float = 3600.0
    slice_seconds: float = SLICE_SECONDS

    @property
    def beat_seconds(self) -> float:
        """Time between two beats."""
        return min(1.0, self.silent_seconds / 4)


class Passed(NamedTuple):
    """Seconds that have passed, and for how many there was no beat."""

    seconds: float
    silent: float


def beat(connection: Connection, seconds: float) -> None:
    """Send beats until the parent is gone."""
    # Written without allocation, so that a worker without memory still sends beats.
    place, one = connection.fileno(), b"."
    with suppress(OSError):
        while True:
            os.write(place, one)
            time.sleep(seconds)


def beats(connection: Connection, seconds: float) -> Iterator[Passed]:
    """Wait for beats and count time as it passes, until the worker is lost."""
    silent = 0.0
    with connection, suppress(EOFError, OSError):
        while True:
            # Beats that are only a little late are waited for; a stop of both sides counts as one wait.
            if connection.poll(2 * seconds):
                passed = len(os.read(connection.fileno(), READ_BYTES)) * seconds
                silent = 0.0
                if not passed:
                    return
            else:
                passed = 2 * seconds
                silent += passed
            yield Passed(passed, silent)
