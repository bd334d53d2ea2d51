"""The exit codes of every command."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What a command's exit code tells a script."""

    DONE = 0
    BELOW_THRESHOLD = 1
    USAGE = 2
    UNUSABLE_INPUT = 3
    SERVER = 4
    TIME_OUT = 5
    INTERNAL = 70
    # As shells report a process that a signal ended: 128 and the signal's number.
    HUNG_UP = 129
    INTERRUPTED = 130
    READER_GONE = 141
    TERMINATED = 143
