"""Bounding what the bodies of all requests take of the memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.errors import BusyError


class Held:
    """The bytes of all bodies that are held in memory, bounded. Used by one thread, that of the event loop.

    Parameters
    ----------
    most : int
        Bytes of all of them.
    """

    def __init__(self, most: int) -> None:
        self.most, self.bytes = most, 0

    @contextmanager
    def account(self) -> Iterator[Account]:
        """Hold a body until the ``with`` statement ends."""
        account = Account(self)
        try:
            yield account
        finally:
            self.bytes -= account.bytes


class Account:
    """What one request holds."""

    def __init__(self, held: Held) -> None:
        self._held, self.bytes = held, 0

    def add(self, count: int) -> None:
        """Hold more; BusyError where all together would hold too much."""
        if self._held.bytes + count > self._held.most:
            raise BusyError("The service holds as many requests as it may already. Try again in a moment.")
        self._held.bytes += count
        self.bytes += count
