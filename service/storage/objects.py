"""The interface of a folder and a bucket: bytes under names.

Names are parts with slashes between them, relative to the place. Every write is atomic: a reader sees all of
it or nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol

from numpy.typing import NDArray


@dataclass(frozen=True)
class Found:
    """An entry of a listing: its name, its bytes, and when it was written, seconds since the epoch."""

    name: str
    size: int
    modified: float


@dataclass(frozen=True)
class Stored:
    """What lies under a name, ready to be sent in parts.

    Attributes
    ----------
    size
        Bytes.
    modified
        When it was written, seconds since the epoch.
    path
        Where it is a file of this machine.
    read
        Gives the bytes from the first number up to the second.
    """

    size: int
    modified: float
    path: Path | None
    read: Callable[[int, int], bytes]


class Objects(Protocol):
    """Keeps bytes under names.

    Whatever reads or writes raises StoreAwayError where the place cannot be reached, StoreFullError where it
    has no room and StoreReadOnlyError where it may not be written.
    """

    place: str
    """What operators know it by: a folder, or the address of a bucket."""

    def within(self, name: str) -> Objects:
        """Return what lies under a name as a place of its own."""

    def check(self) -> None:
        """Raise StoreAwayError if the place cannot be seen from here; the message says what to do."""

    def begin(self, prefix: str) -> None:
        """Make room for names under this one. Once that is dropped nothing more can be kept there."""

    def put(self, name: str, data: bytes) -> None:
        """Keep bytes in place of what had the name."""

    def draft(self, name: str) -> AbstractContextManager[IO[bytes]]:
        """Open a file of this machine to be written and then kept under the name; else it goes."""

    def keep(self, draft: IO[bytes], name: str) -> None:
        """Keep what was written to a draft in place of what had the name."""

    def get(self, name: str) -> bytes:
        """Return all bytes; raise FileNotFoundError if there are none."""

    def many(self, names: Sequence[str]) -> Iterator[bytes]:
        """Return the bytes of several names in their order, as ``get`` does, however far away they are."""

    def array(self, name: str) -> NDArray[Any]:
        """Return an .npy file for reading; what it holds is never written anew."""

    def find(self, name: str) -> Stored | None:
        """Describe what lies under a name; None if there is nothing."""

    def found(self, prefix: str = "") -> Iterator[Found]:
        """List all that lies under a name, in no order, or everything."""

    def delete(self, names: Iterable[str]) -> None:
        """Remove what lies under these names; those that are not there do not matter."""

    def drop(self, prefix: str) -> None:
        """Remove all that lies under a name, perhaps a little later."""

    def tidy(self, age_seconds: float) -> None:
        """Remove drafts of this age that a killed process left behind."""
