"""A folder of this machine, or one that several machines mount."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from service.errors import StoreAwayError, StoreDamagedError, StoreFullError, StoreReadOnlyError
from service.storage.checking import checked, pieces
from service.storage.checksums import Expected, damage_reported
from service.storage.objects import Found, Objects, Stored

NO_ROOM = "The disk is full. Try again when there is room."
NOT_WRITABLE = "The data folder cannot be written now. Try again when its operator has fixed it."

FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
READ_ONLY_ERRNOS = (errno.EROFS, errno.EACCES, errno.EPERM)


class Folder:
    """One file for each name. Satisfies ``Objects``.

    Parameters
    ----------
    folder : Path
        It need not be there.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.place = str(folder)

    def within(self, name: str) -> Folder:
        """Return the part of the store under a name, as a store."""
        return Folder(self._folder / name)

    def check(self) -> None:
        """Raise StoreAwayError if it is not there; the message says what to do."""
        if not self._folder.is_dir():
            raise StoreAwayError(f"{self.place} does not exist. Mount the service's data folder there.")

    def begin(self, prefix: str) -> None:
        """Make a folder and its parents; files are written only to existing folders."""
        folder = self._folder / prefix
        with translate_errors():
            missing = [above for above in (folder, *folder.parents) if not above.exists()]
            folder.mkdir(parents=True, exist_ok=True)
            for made in missing:
                _sync(made.parent)

    def put(self, name: str, data: bytes, *, durable: bool = False) -> None:
        """Store bytes under a name, replacing what was there."""
        with self.draft(name) as draft:
            draft.write(data)
            self.keep(draft, name, durable=durable)

    @contextmanager
    def draft(self, name: str) -> Iterator[IO[bytes]]:
        """Open a temporary file beside its final place."""
        with (
            translate_errors(),
            tempfile.NamedTemporaryFile(
                dir=(self._folder / name).parent, prefix=".", suffix=".tmp", delete=False
            ) as file,
        ):
            try:
                yield file
            finally:
                # Once it is kept, it has another name.
                Path(file.name).unlink(missing_ok=True)

    def keep(self, draft: IO[bytes], name: str, *, durable: bool = False) -> None:
        """Move a draft into place."""
        path = self._folder / name
        with translate_errors():
            draft.flush()
            if durable:
                os.fsync(draft.fileno())
            Path(draft.name).replace(path)
            if durable:
                # A new name is an entry of its folder.
                _sync(path.parent)

    def get(self, name: str) -> bytes:
        """Return all bytes; raise FileNotFoundError if there are none."""
        with _damage_noticed(name):
            return (self._folder / name).read_bytes()

    def many(self, names: Sequence[str]) -> Iterator[bytes]:
        """Return the bytes of several names in their order."""
        return map(self.get, names)

    def array(self, name: str, expected: Expected = None) -> NDArray[Any]:
        """Return an array mapped from its file, which this process reads whole once to check it."""
        if expected is not None:
            self._check(name, expected)
        with damage_reported(name):
            found: NDArray[Any] = np.load(self._folder / name, mmap_mode="r")
        return found

    # As many as a worker uses: those of a pass of each job whose plan it keeps.
    @lru_cache(maxsize=16)  # noqa: B019  (a process has few stores, and as long as it runs)
    def _check(self, name: str, expected: Expected) -> None:
        stored = self.find(name)
        if stored is not None:
            for _ in pieces(checked(name, stored, expected)):
                pass

    def find(self, name: str) -> Stored | None:
        """Describe what is stored under a name; None if there is nothing."""
        try:
            return replace(stored_file(os.open(self._folder / name, os.O_RDONLY), name), read_ahead=True)
        except FileNotFoundError:
            return None

    def found(self, prefix: str = "") -> Iterator[Found]:
        """List all files under a name, or all."""
        for path in (self._folder / prefix).rglob("*"):
            # Files come and go while other processes render, read and delete.
            try:
                state, is_file = path.stat(), path.is_file()
            except OSError:
                continue
            if is_file:
                name = path.relative_to(self._folder).as_posix()
                yield Found(name, state.st_size, state.st_mtime)

    def delete(self, names: Iterable[str]) -> None:
        """Remove files; those that are not there do not matter."""
        for name in names:
            (self._folder / name).unlink(missing_ok=True)

    def drop(self, prefix: str) -> None:
        """Remove a folder."""
        shutil.rmtree(self._folder / prefix, ignore_errors=True)

    def tidy(self, age_seconds: float) -> None:
        """Remove temporary files of this age."""
        for path in self._folder.rglob(".*.tmp"):
            if _is_older(path, age_seconds):
                path.unlink(missing_ok=True)


class _OpenFile:
    """A file that can be read although it is deleted meanwhile. It is closed when nothing refers to it."""

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self._name = descriptor, name

    def read(self, start: int, end: int) -> bytes:
        with _damage_noticed(self._name):
            return os.pread(self._descriptor, end - start, start)

    def __del__(self) -> None:
        os.close(self._descriptor)


@contextmanager
def _damage_noticed(name: str) -> Iterator[None]:
    """Report a part of the disk that cannot be read any more as a damaged file."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.EIO:
            raise StoreDamagedError(name) from error
        raise


def stored_file(descriptor: int, name: str = "") -> Stored:
    """Describe an open file, which stays open as long as the description is kept."""
    file, status = _OpenFile(descriptor, name), os.fstat(descriptor)
    return Stored(status.st_size, status.st_mtime, file.read)


def _sync(folder: Path) -> None:
    """Write the entries of a folder to the disk, unless it is one of others, above the data folder."""
    with suppress(PermissionError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def translate_errors() -> Iterator[None]:
    """Translate errors of a disk that cannot be written now; others are permanent.

    Raises
    ------
    StoreFullError
        If the disk is full.
    StoreReadOnlyError
        If the folder may not be written.
    """
    try:
        yield
    except OSError as error:
        if error.errno in FULL_ERRNOS:
            raise StoreFullError(NO_ROOM) from error
        if error.errno in READ_ONLY_ERRNOS:
            raise StoreReadOnlyError(NOT_WRITABLE) from error
        raise


def _is_older(path: Path, age_seconds: float) -> bool:
    """Whether nothing was written here for this long; with 0 always true."""
    try:
        return not age_seconds or path.stat().st_mtime < time.time() - age_seconds
    except FileNotFoundError:
        return False


BUCKET = "s3://"
JOBS, ASSETS = "jobs", "assets"
"""Top-level directories of a place."""


def place_of(address: str) -> Objects:
    """Return the bucket of an address ``s3://bucket/prefix``, or the folder of any other.

    Raises
    ------
    StoreMissingError
        If the extra for buckets is not installed.
    """
    if not address.startswith(BUCKET):
        return Folder(Path(address))
    from service.storage.bucket import Bucket  # noqa: PLC0415  (an extra)

    return Bucket(address)
