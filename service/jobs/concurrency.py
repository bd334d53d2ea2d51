"""Limits on what requests do at once: how many are worked on, and how much memory their bodies take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.errors import BusyError


class ConcurrencyLimit:
    """Bounds how many requests of a kind are worked on at once. Used by one thread, that of the event loop.

    >>> limit = ConcurrencyLimit(2, "quotes")
    >>> with limit.acquired():
    ...     print(limit.free)
    1
    """

    def __init__(self, count: int, made: str) -> None:
        self.free, self._made = count, made

    @contextmanager
    def acquired(self) -> Iterator[None]:
        """Count one more until the ``with`` statement ends.

        Raises
        ------
        BusyError
            There are as many as there may be.
        """
        if not self.free:
            detail = f"The service makes as many {self._made} as it may already. Try again in a moment."
            raise BusyError(detail)
        self.free -= 1
        try:
            yield
        finally:
            self.free += 1


class BodyMemoryLimit:
    """Bounds the bytes of all bodies in memory. Used by one thread, that of the event loop.

    Parameters
    ----------
    most : int
        Bytes of all of them.
    """

    def __init__(self, most: int) -> None:
        self.most, self.bytes = most, 0

    @contextmanager
    def account(self) -> Iterator[Account]:
        """Count a body until the ``with`` statement ends."""
        account = Account(self)
        try:
            yield account
        finally:
            self.bytes -= account.bytes


class Account:
    """What one request holds."""

    def __init__(self, limit: BodyMemoryLimit) -> None:
        self._limit, self.bytes = limit, 0

    def add(self, count: int) -> None:
        """Count more bytes; BusyError where all together would be too many."""
        if self._limit.bytes + count > self._limit.most:
            raise BusyError("The service holds as many requests as it may already. Try again in a moment.")
        self._limit.bytes += count
        self.bytes += count
