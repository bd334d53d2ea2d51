"""Bounding how many do the same thing at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.errors import BusyError


class Seats:
    """So many may sit at once. Used by one thread, that of the event loop.

    >>> seats = Seats(2, "quotes")
    >>> with seats.taken():
    ...     print(seats.free)
    1
    """

    def __init__(self, count: int, made: str) -> None:
        self.free, self._made = count, made

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Sit down, and leave at the end of the ``with`` statement.

        Raises
        ------
        BusyError
            All seats are taken.
        """
        if not self.free:
            detail = f"The service makes as many {self._made} as it may already. Try again in a moment."
            raise BusyError(detail)
        self.free -= 1
        try:
            yield
        finally:
            self.free += 1
