"""The interface of a folder and a bucket: bytes under names.

Names are parts with slashes between them, relative to the place. Every write is atomic: a reader sees all of
it or nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import IO, Any, Protocol

from numpy.typing import NDArray

from service.storage.checksums import Expected


@dataclass(frozen=True)
class Found:
    """An entry of a listing: its name, its bytes, and when it was written, seconds since the epoch."""

    name: str
    size: int
    modified: float


@dataclass(frozen=True)
class Stored:
    """A stored object, ready to be sent in parts.

    Attributes
    ----------
    size
        Bytes.
    modified
        When it was written, seconds since the epoch; None if it differs with each request.
    read_ahead
        Whether the requested bytes are read before any is sent, so that damage is answered with an error; not
        from a bucket.
    read
        Gives the bytes from the first number up to the second. Those of a folder stay there although the file
        is deleted meanwhile; a bucket raises FileNotFoundError then.
    """

    size: int
    modified: float | None
    read: Callable[[int, int], bytes]
    read_ahead: bool = False


class Objects(Protocol):
    """Keeps bytes under names.

    Reads and writes raise StoreAwayError if the place cannot be reached, StoreFullError if it is full, and
    StoreReadOnlyError if it may not be written.
    """

    place: str
    """Name for operators: a folder, or the address of a bucket."""

    def within(self, name: str) -> Objects:
        """Return the part of the store under a name, as a store."""

    def check(self) -> None:
        """Raise StoreAwayError if the place cannot be seen from here; the message says what to do."""

    def begin(self, prefix: str) -> None:
        """Create the folder of a name. After its deletion nothing can be stored there."""

    def put(self, name: str, data: bytes, *, durable: bool = False) -> None:
        """Store bytes under a name, replacing what was there; ``durable`` as in `keep`."""

    def draft(self, name: str) -> AbstractContextManager[IO[bytes]]:
        """Open a temporary file of this machine, which `keep` stores under the name."""

    def keep(self, draft: IO[bytes], name: str, *, durable: bool = False) -> None:
        """Store what was written to a draft under its name, replacing what was there.

        Parameters
        ----------
        durable
            Whether it is still there after a loss of power once this returns.
        """

    def get(self, name: str) -> bytes:
        """Return all bytes; raise FileNotFoundError if there are none."""

    def many(self, names: Sequence[str]) -> Iterator[bytes]:
        """Return the bytes of several names in their order, as ``get`` does, also from a remote store."""

    def array(self, name: str, expected: Expected = None) -> NDArray[Any]:
        """Return an .npy file for reading; its contents never change.

        Raises
        ------
        StoreDamagedError
            If they are not as expected.
        """

    def find(self, name: str) -> Stored | None:
        """Describe what is stored under a name; None if there is nothing."""

    def found(self, prefix: str = "") -> Iterator[Found]:
        """List everything under a name, or everything, in no order."""

    def delete(self, names: Iterable[str]) -> None:
        """Delete these names; those that do not exist are ignored."""

    def drop(self, prefix: str) -> None:
        """Delete everything under a name, perhaps a little later."""

    def tidy(self, age_seconds: float) -> None:
        """Remove drafts of this age that a killed process left behind."""
