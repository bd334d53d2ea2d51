"""One service at a time in a data folder."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.errors import StoreTakenError


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Make a folder, and keep other services off it until the block ends or the process dies.

    Raises
    ------
    StoreTakenError
        If another service uses it.
    OSError
        If it cannot be made or written.
    """
    # It has the scenes and pictures of all: other users of the machine stay out.
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            message = f"Another service uses {folder}. Stop it, or name another folder."
            raise StoreTakenError(message) from None
        yield
