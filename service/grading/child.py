"""What runs inside the process of one test."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import resource
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

STDOUT, STDERR = 1, 2


@dataclass(frozen=True, slots=True)
class Ended:
    """The last message that a process sends.

    Attributes
    ----------
    error : Exception or None
        The exception that the call raised.
    cpu_seconds : float
    """

    error: Exception | None
    cpu_seconds: float


def do(answer: Connection, call: Callable[[], Any], memory: int | None) -> None:
    """Call a function and send back its result or its exception, and the CPU seconds of this process.

    Parameters
    ----------
    call
        May return an iterator: each result is sent as it comes, and replaces the previous one.
    memory
        Bytes that this process may allocate beyond those of the program itself; None for no limit.
    """
    # Ctrl-C at a terminal goes to the parent, which ends this process.
    os.setsid()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if memory is not None:
        most = _taken() + memory
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    # Stdout carries nothing but the document of the command.
    os.dup2(STDERR, STDOUT)
    error = None
    try:
        given = call()
        for result in given if isinstance(given, Iterator) else (given,):
            answer.send((result, time.process_time()))
    except Exception as raised:  # noqa: BLE001 - any error fails this test alone
        error = _picklable(raised)
    answer.send(Ended(error, time.process_time()))


def _taken() -> int:
    """Bytes of address space of this process, mostly libraries that the parent has loaded."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _picklable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - pickled in this process
    except Exception:  # noqa: BLE001 - pickling foreign exceptions may raise anything
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
