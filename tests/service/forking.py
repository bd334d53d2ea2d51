"""Servers forked from a process that has imported the service: each of them would spend two seconds on that.

The first server of the tests starts that process, ``python -m tests.service.forking``.
"""

import ctypes
import importlib
import json
import os
import runpy
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from functools import cache, partial
from typing import IO, Any

from service import server
from service.workers.fork_server import ONE_THREAD

PR_SET_CHILD_SUBREAPER = 36
REQUEST_BYTES = 1 << 20
# Also imported while a service starts.
LATER = (
    "alembic.command",
    "anyio._backends._asyncio",
    "sqlalchemy.dialects.postgresql.psycopg",
    "sqlalchemy.dialects.sqlite",
    "uvicorn.lifespan.on",
    "uvicorn.loops.auto",
)


class Forked(subprocess.Popen[bytes]):
    """``python -m MODULE HANDLE`` without the imports: a child of this process, as any other."""

    def __init__(
        self,
        args: Sequence[str],
        *,
        env: Mapping[str, str],
        stderr: IO[bytes] | None,
        pass_fds: Sequence[int],
    ) -> None:
        self._request = json.dumps([args[2], dict(env)]).encode()
        self._handles = [*pass_fds, 2 if stderr is None else stderr.fileno()]
        super().__init__(args)

    def _execute_child(self, *_: Any) -> None:
        requests = _parent()
        _adopt_orphans(adopt=True)
        try:
            socket.send_fds(requests, [self._request], self._handles)
            self.pid = int(requests.recv(REQUEST_BYTES))
        finally:
            _adopt_orphans(adopt=False)
        self._child_created = True


# Only Linux lets a process adopt the children of its children.
running = partial(server.running, popen=Forked if sys.platform == "linux" else subprocess.Popen)
"""As `service.server.running`, without what a new process inherits: PYTHONPATH, resource limits."""


@cache
def _parent() -> socket.socket:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with there:
        command = [sys.executable, "-m", __name__, str(there.fileno())]
        there.set_inheritable(True)
        # A process with threads cannot be forked safely.
        os.posix_spawn(sys.executable, command, os.environ | dict.fromkeys(ONE_THREAD, "1"))
    return here


def _adopt_orphans(*, adopt: bool) -> None:
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, int(adopt))


def _serve(requests: socket.socket) -> None:
    for name in LATER:
        importlib.import_module(name)
    while True:
        request, handles, _, _ = socket.recv_fds(requests, REQUEST_BYTES, 2)
        if not request:
            return None
        if os.fork() == 0:
            parent = os.getpid()
            if os.fork() == 0:
                return _run(requests, parent, handles, *json.loads(request))
            os._exit(0)
        os.wait()
        for handle in handles:
            os.close(handle)


def _run(
    requests: socket.socket, parent: int, handles: list[int], module: str, environment: dict[str, str]
) -> None:
    """Run a module; once its parent has ended, the tests are its parent."""
    while os.getppid() == parent:
        time.sleep(0.001)
    requests.send(str(os.getpid()).encode())
    requests.close()
    os.dup2(handles[1], 2)
    os.close(handles[1])
    os.environ.clear()
    os.environ.update(environment)
    sys.argv[1:] = [str(handles[0])]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
