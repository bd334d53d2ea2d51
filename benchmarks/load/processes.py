"""CPU seconds, memory and workers of a service that runs, from ``/proc``."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
PAGE = os.sysconf("SC_PAGE_SIZE")


def cpu_seconds(process: int) -> float:
    """User and system time of all threads of a process, without its children."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def resident_bytes(process: int) -> int:
    """Memory that a process has in use."""
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE


def workers_of(server: int) -> list[int]:
    """Process ids of the workers of a service."""
    return [worker for fork_server in fork_servers_of(server) for worker in _children(fork_server)]


def fork_servers_of(server: int) -> list[int]:
    """Process id of what the workers of a service are forked from, in a list as it may not run."""
    return [child for child in _children(server) if b"spawn_main" in _read(Path(f"/proc/{child}/cmdline"))]


def _children(process: int) -> list[int]:
    with suppress(OSError):
        threads = [*Path(f"/proc/{process}/task").iterdir()]
        return [int(child) for thread in threads for child in _read(thread / "children").split()]
    return []


def is_alive(process: int) -> bool:
    """Whether a process runs, or could."""
    state = _read(Path(f"/proc/{process}/stat")).rpartition(b")")[2].split()
    return bool(state) and state[0] != b"Z"


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""
