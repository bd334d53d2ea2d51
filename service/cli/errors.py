"""Errors that commands raise, and exit codes; the table in ``failures.py`` maps one to the other.

CommandError                    wrong use: an invalid option, or an output that cannot be written
├── InputError                  a file that the command was given cannot be used
│   └── UnusableSceneError      a scene file, with its text and all that is wrong in it
├── RefusedOptionsError         a service refused the values of options
└── ServiceStartError           a service did not start, or stopped by itself
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from schemas.errors import Problem


class CommandError(Exception):
    """A command cannot run; the message says why and what to do."""


class InputError(CommandError):
    """A file that a command was given cannot be used."""


class UnusableSceneError(InputError):
    """A scene file is not a usable scene.

    Parameters
    ----------
    name
        The file as the user named it.
    text
        Its content, of which lines are shown.
    problems
        Problems; pointers, lines and columns are those of `text`.
    more
        Number of further problems.
    """

    def __init__(self, name: str, text: bytes, problems: Sequence[Problem], more: int = 0) -> None:
        count = len(problems) + more
        super().__init__(f"{name} cannot be used: {count} error{'s' if count != 1 else ''}.")
        self.name = name
        self.text = text
        self.problems = problems
        self.more = more


class RefusedOptionsError(CommandError):
    """A service refused the values of a command's options.

    Parameters
    ----------
    message
        Each option with what is wrong with it.
    problems
        The same for programs; pointers are those of the request.
    """

    def __init__(self, message: str, problems: Sequence[Problem]) -> None:
        super().__init__(message)
        self.problems = problems


class ServiceStartError(CommandError):
    """A service did not start, or it stopped by itself."""


class ExitCode(IntEnum):
    """Exit codes of commands."""

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
