"""Disk space reserved for deletions: a database needs some to delete what fills the disk."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from service.storage.database.connection import Database

RESERVE_FILE = "reserve"
RESERVE_BYTES = 8 << 20
"""Twice what SQLite writes to its log before it begins it anew."""
BLOCK_BYTES = 1 << 16


class Reserve:
    """A file beside the database, of some megabytes where the disk has room for it.

    Parameters
    ----------
    folder : Path
        Of the database.
    database : Database
        One on PostgreSQL is on no disk of ours, and there is no file.
    """

    def __init__(self, folder: Path, database: Database) -> None:
        self._folder, self._path = folder, folder / RESERVE_FILE
        self._wanted = not database.shared
        self._lock = threading.Lock()

    def keep(self) -> None:
        """Bring the file to its size where the disk has room for twice as much."""
        if self._free() >= 2 * RESERVE_BYTES:
            self._fill(RESERVE_BYTES)

    def give_up(self) -> bool:
        """Free the reserve if the disk is nearly full; return whether it is."""
        full = self._free() < RESERVE_BYTES
        if full:
            with self._lock, suppress(OSError):
                self._path.unlink(missing_ok=True)
        return full

    @contextmanager
    def given_up(self) -> Iterator[None]:
        """Free the reserve until the block ends, if the disk is nearly full."""
        full = self.give_up()
        try:
            yield
        finally:
            if full:
                # What was freed is for further deletions first.
                self._fill(min(RESERVE_BYTES, self._free()))

    def _free(self) -> int:
        return shutil.disk_usage(self._folder).free

    def _fill(self, size: int) -> None:
        """Write what the file lacks, as far as the disk has room."""
        with self._lock, suppress(OSError):
            if not self._wanted:
                return
            with self._path.open("ab", buffering=0) as file:
                # File systems that compress would store zeros without space.
                while (missing := size - os.fstat(file.fileno()).st_size) > 0:
                    file.write(os.urandom(min(BLOCK_BYTES, missing)))
