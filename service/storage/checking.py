"""Stored files whose reads are checked."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

from service.errors import StoreDamagedError
from service.storage.checksums import BAND_BYTES, Checksum, Expected, read_checked
from service.storage.objects import Stored

PIECE_BYTES = 4 << 20
"""Bytes of a large file that are in memory at once."""


def checked(name: str, stored: Stored, expected: Expected) -> Stored:
    """Return a file whose reads raise StoreDamagedError if its bytes are damaged.

    One whose SHA-256 is known is read whole before the first read.
    """
    match expected:
        case None:
            return stored
        case Checksum(size=size) if size != stored.size:
            raise StoreDamagedError(name)
        case Checksum():
            return replace(stored, read=_Banded(name, stored, expected).read)
    return replace(stored, read=_Hashed(name, stored, expected).read)


def pieces(stored: Stored) -> Iterator[bytes]:
    """Read a file from its beginning to its end."""
    size = stored.size
    return (stored.read(*ends) for ends in pairwise([*range(0, size, PIECE_BYTES), size]))


@dataclass(frozen=True)
class _Banded:
    """A file of which each band has a checksum."""

    name: str
    stored: Stored
    expected: Checksum
    known: set[int] = field(default_factory=set)
    """First bytes of the bands checked so far, so that bytes read ahead are checked once."""

    def read(self, begin: int, end: int) -> bytes:
        first = begin - begin % BAND_BYTES
        last = min(end + -end % BAND_BYTES, self.stored.size)
        bands = range(first, last, BAND_BYTES)
        if self.known.issuperset(bands):
            return self.stored.read(begin, end)
        whole = read_checked(self.name, lambda: self.stored.read(first, last), self._fits(first, last))
        self.known.update(bands)
        return whole[begin - first : end - first]

    def _fits(self, first: int, last: int) -> Callable[[bytes], bool]:
        return lambda content: len(content) == last - first and self.expected.fits(content, first)


@dataclass
class _Hashed:
    """A file whose SHA-256 is known."""

    name: str
    stored: Stored
    expected: str
    is_known: bool = False

    def read(self, begin: int, end: int) -> bytes:
        if not self.is_known:
            read_checked(self.name, self._sha256, self.expected.__eq__)
            self.is_known = True
        return self.stored.read(begin, end)

    def _sha256(self) -> str:
        digest = hashlib.sha256()
        for piece in pieces(self.stored):
            digest.update(piece)
        return digest.hexdigest()
