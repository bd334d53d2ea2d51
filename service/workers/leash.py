"""The first thing in a worker process: it dies with its parent from here on, even while it still imports.

Importing this imports next to nothing: libraries take seconds on a busy machine.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from typing import Any

PR_SET_PDEATHSIG = 1


def _die_with(parent: int) -> None:
    """Have the kernel kill this process when its parent dies; on Linux alone it does that."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)  # the parent died before the line above could notice


class Leash:
    """What is read first of all that a new process gets, and ties it to its parent as it is read.

    Parameters
    ----------
    parent : int
        Process id of the one that starts others.
    """

    def __init__(self, parent: int) -> None:
        self._parent = parent

    def __reduce__(self) -> tuple[Any, ...]:
        return _tied, (self._parent,)


def _tied(parent: int) -> Leash:
    _die_with(parent)
    return Leash(parent)


def run(_leash: Leash, function: Callable[..., None], *arguments: Any) -> None:
    """Call a function; its module, and what it is given, are imported once the leash is read."""
    function(*arguments)
