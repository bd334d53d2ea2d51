"""Bounding how many do the same thing at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from service.errors import BusyError


class Seats:
    """So many may sit at once. Used by one thread, that of the event loop.

    >>> seats = Seats(2)
    >>> with seats.taken():
    ...     print(seats.free)
    1
    """

    def __init__(self, count: int) -> None:
        self.free = count

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Sit down, and leave at the end of the ``with`` statement.

        Raises
        ------
        BusyError
            All seats are taken.
        """
        if not self.free:
            raise BusyError("The service makes as many quotes as it may already. Try again in a moment.")
        self.free -= 1
        try:
            yield
        finally:
            self.free += 1
