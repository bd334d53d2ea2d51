"""The fork server: a process that imports the renderer once, and from which workers are forked.

A worker starts in milliseconds, however long the imports take. Importing this imports next to nothing: so the
fork server imports while the service does. That of Python's library leaves folders behind when it is killed.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from multiprocessing.reduction import recv_handle, send_handle
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from service.workers.worker import WorkerSetup

# Each worker is one thread: the slots are the parallelism.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

PR_SET_PDEATHSIG = 1


class ForkServer:
    """The fork server of this process; one that is lost is replaced when the next worker is forked.

    On Linux it dies with the thread that has started it, and the workers die with it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: SpawnProcess | None = None

    def start(self) -> None:
        """Start it unless it runs; it imports on its own."""
        with self._lock:
            if self._process is None or not self._process.is_alive():
                self._start()

    def fork(self, setup: WorkerSetup, connection: Connection, pulse: Connection) -> None:
        """Have a worker forked, which runs `service.workers.worker.work`, without waiting for it.

        If the fork server dies before that, the pipes end.

        Raises
        ------
        OSError
            If the fork server cannot be started, or dies meanwhile.
        """
        self.start()
        with self._lock:
            self._requests.send(setup)
            for end in (connection, pulse):
                send_handle(self._requests, end.fileno(), None)

    def kill(self) -> None:
        """Kill it, with its workers."""
        with self._lock:
            if self._process is not None:
                self._process.kill()
                self._process.join()

    def _start(self) -> None:
        for name in ONE_THREAD:
            os.environ[name] = "1"
        context = get_context("spawn")
        self._requests, there = context.Pipe()
        with there:
            process = context.Process(target=_serve, args=(os.getpid(), there), daemon=True)
            process.start()
        self._process = process


fork_server = ForkServer()


def _serve(parent: int, requests: Connection) -> None:
    """Fork a worker for each request, until the service is gone."""
    _die_with(parent)
    # Ctrl-C at a terminal is for the service, and workers are not waited for.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    from service import logs  # noqa: PLC0415  (with the following one what takes so long)

    logs.configure("info")
    try:
        _fork_each(requests)
    except Exception:  # noqa: BLE001  (multiprocessing would print it as no log is written)
        sys.excepthook(*sys.exc_info())
        os._exit(1)


def _fork_each(requests: Connection) -> None:
    from service.workers.worker import work  # noqa: PLC0415  (as above)

    while True:
        try:
            setup = requests.recv()
            connection, pulse = (Connection(recv_handle(requests)) for _ in range(2))
        except EOFError:
            return
        with connection, pulse:
            _fork(requests, partial(work, connection, pulse, setup))


def _fork(requests: Connection, call: Callable[[], None]) -> None:
    """Call a function in a process of its own, which ends after it."""
    this = os.getpid()
    try:
        if os.fork() != 0:
            return
    except OSError:
        # There are too many processes. The slot notices the end of its pipe, and asks again later.
        sys.excepthook(*sys.exc_info())
        return
    code = 1
    try:
        _die_with(this)
        requests.close()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        call()
        code = 0
    except Exception:  # noqa: BLE001  (nothing else would report it)
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stderr.flush()
        os._exit(code)


def _die_with(parent: int) -> None:
    """Let the kernel kill this process when its parent dies; only Linux does."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)  # the parent died before the line above could notice
