"""Processes of a service: found in /proc, and stopped for a while."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def workers_of(server: int) -> list[int]:
    """Process ids of the workers of a service."""
    return [worker for fork_server in fork_servers_of(server) for worker in _children(fork_server)]


def fork_servers_of(server: int) -> list[int]:
    """Process id of the fork server of a service, in a list that is empty if it does not run."""
    return [child for child in _children(server) if b"spawn_main" in _read(Path(f"/proc/{child}/cmdline"))]


@contextmanager
def held(*processes: int) -> Iterator[None]:
    """Stop processes until the block ends."""
    for process in processes:
        os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        for process in processes:
            os.kill(process, signal.SIGCONT)


def is_alive(process: int) -> bool:
    """Whether a process is alive."""
    state = _read(Path(f"/proc/{process}/stat")).rpartition(b")")[2].split()
    return bool(state) and state[0] != b"Z"


def ticks_of(process: int) -> int:
    """CPU time of a process so far, in ticks of the clock; 0 of one that is gone."""
    fields = _read(Path(f"/proc/{process}/stat")).rpartition(b")")[2].split()
    return sum(map(int, fields[11:13]))


def _children(process: int) -> list[int]:
    with suppress(OSError):
        threads = [*Path(f"/proc/{process}/task").iterdir()]
        return [int(child) for thread in threads for child in _read(thread / "children").split()]
    return []


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""
