"""Who may use a data folder: one service alone, or several that share a database."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.errors import StoreTakenError


@contextmanager
def held(folder: Path, *, shared: bool) -> Iterator[None]:
    """Make a folder, and keep other services off it until the block ends or the process dies.

    Parameters
    ----------
    folder : Path
        The data folder.
    shared : bool
        Whether others may use it that share it as well.

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
            fcntl.flock(lock, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            message = (
                f"Another service uses {folder}. Stop it, or name another folder; "
                "several services can share one on PostgreSQL alone."
            )
            raise StoreTakenError(message) from None
        yield
