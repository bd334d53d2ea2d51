"""Checksums of stored files.

Each band of a file has a checksum of its own, so that a part is checked without reading the rest.
"""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from typing import IO, Any, TypeVar

from service.errors import StoreDamagedError

BAND_BYTES = 1 << 20
"""A range costs reading at most two bands more, and a gigabyte has a few kilobytes of checksums."""
MAX_READS = 2
"""Reads of a file before it counts as damaged: a network or memory may garble one."""
READER_ERRORS = (ValueError, EOFError, LookupError, NotImplementedError, RuntimeError, zipfile.BadZipFile)
"""Exceptions of readers of .npy and .npz files that are not as they were written."""

LOSS_ERRORS = (FileNotFoundError, StoreDamagedError)
"""Exceptions of a file that is damaged or missing."""

Content = TypeVar("Content")


@dataclass(frozen=True)
class Checksum:
    """The size of a file, bytes, and the CRC-32 of each of its bands."""

    size: int
    crc32: tuple[int, ...]

    def document(self) -> dict[str, Any]:
        """Describe it as `restored` reads it."""
        return asdict(self)

    def fits(self, content: bytes, begin: int = 0) -> bool:
        """Whether these are bytes of the file from the border of a band on."""
        first, found = begin // BAND_BYTES, tuple(_crc32(content))
        return found == self.crc32[first : first + len(found)]


Expected = Checksum | str | None
"""The checksum of a file, the SHA-256 of the whole, or None if neither is known."""


def restored(document: dict[str, Any]) -> Checksum:
    """Read what `Checksum.document` has described."""
    return Checksum(document["size"], tuple(document["crc32"]))


def checksum_of(content: bytes) -> Checksum:
    """Compute the checksum of a file."""
    return Checksum(len(content), tuple(_crc32(content)))


def checksum_of_file(file: IO[bytes]) -> Checksum:
    """Compute the checksum of an open file from its beginning."""
    file.seek(0)
    sums = tuple(map(zlib.crc32, iter(lambda: file.read(BAND_BYTES), b"")))
    return Checksum(file.tell(), sums)


def _crc32(content: bytes) -> Iterator[int]:
    view = memoryview(content)
    return (zlib.crc32(view[begin : begin + BAND_BYTES]) for begin in range(0, len(content), BAND_BYTES))


def is_whole(content: bytes, expected: Expected) -> bool:
    """Whether these are all bytes of a file."""
    if isinstance(expected, Checksum):
        return len(content) == expected.size and expected.fits(content)
    return expected is None or hashlib.sha256(content).hexdigest() == expected


def read_checked(name: str, read: Callable[[], Content], fits: Callable[[Content], bool]) -> Content:
    """Read and verify, with a second attempt before StoreDamagedError."""
    for _ in range(MAX_READS):
        with suppress(StoreDamagedError):
            content = read()
            if fits(content):
                return content
    raise StoreDamagedError(name)


@contextmanager
def damage_reported(name: str) -> Iterator[None]:
    """Read an .npy or .npz file; StoreDamagedError if it is not one that was written here."""
    try:
        yield
    except READER_ERRORS as error:
        raise StoreDamagedError(name) from error


def is_lost(read: Callable[[], object]) -> bool:
    """Whether what this reads is damaged or missing; other errors are raised."""
    try:
        read()
    except LOSS_ERRORS:
        return True
    return False
