"""Limits on what requests hold at once, shared by users: connections, memory, processors, pictures."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from weakref import WeakValueDictionary

from anyio import CapacityLimiter

from service.access.principals import Principal
from service.errors import BusyError
from service.storage.objects import Stored


class SharedRoom:
    """Shared capacity: no claimant may hold more than remains free, so that some is left for the next.

    One claimant holds at most half of it, and each of two a third (Choudhury and Hahne, "Dynamic queue length
    thresholds", 1998). Used by one thread, that of the event loop.

    Parameters
    ----------
    most : int
        All of the room.
    """

    def __init__(self, most: int) -> None:
        self._free = most
        self._held: Counter[str] = Counter()

    def held(self, claimant: str) -> int:
        """Amount that a claimant holds."""
        return self._held[claimant]

    def take(self, claimant: str, amount: int = 1) -> bool:
        """Take an amount; False if the claimant may not have as much."""
        held, left = self._held[claimant], self._free - amount
        # The last of the capacity is for claimants without any.
        if left < (held + amount if held else 0):
            return False
        self._held[claimant] += amount
        self._free -= amount
        return True

    def give_back(self, claimant: str, amount: int = 1) -> None:
        """Give back an amount."""
        self._free += amount
        self._held[claimant] -= amount
        if not self._held[claimant]:
            del self._held[claimant]


class StreamLimit:
    """Bounds the requests of each user that wait for events. Used by one thread, that of the event loop.

    Each holds a connection. Without authentication all users are one, and there is no limit.

    Parameters
    ----------
    most : int
        Requests of one user.
    most_of_all : int
        Requests of all users, who share them.
    """

    def __init__(self, most: int, most_of_all: int) -> None:
        self.most = most
        self._room = SharedRoom(most_of_all)

    @contextmanager
    def waiting(self, principal: Principal) -> Iterator[None]:
        """Count a request until the block ends; BusyError if the user has too many."""
        if principal.is_everyone:
            yield
            return
        user = principal.name
        held = self._room.held(user)
        if held >= self.most or not self._room.take(user):
            raise BusyError(
                f"{held} of your requests wait, the maximum. Close a page or a program that watches one."
            )
        try:
            yield
        finally:
            self._room.give_back(user)


class Readers:
    """Bounds the documents that are read at once, and those of one user to half of them.

    Parameters
    ----------
    most : int
        Documents of all users.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self.limiter = CapacityLimiter(most)
        self._of: WeakValueDictionary[str, CapacityLimiter] = WeakValueDictionary()

    def of(self, user: str) -> CapacityLimiter:
        """Return the limiter of one user; it exists while any request of theirs has it."""
        return self._of.setdefault(user, CapacityLimiter(max(1, self._most // 2)))


@dataclass(eq=False)
class _Turn:
    """A picture that waits for room."""

    claimant: str
    pixels: int
    begun: asyncio.Event


class PixelLimit:
    """Bounds the pixels of the pictures that are encoded at once. Used only by the event loop's thread.

    The claimant with the fewest pixels since all of theirs began to wait comes first, with the smallest
    picture. Small pictures do not wait for large ones.

    Parameters
    ----------
    most : int
        Pixels of all of them; a larger picture is encoded alone.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        # 512 x 512 of the default take hundredths of a second: sixteen of them have room beside all others.
        self._small, self._reserve = most // 64, most // 4
        self._taken = 0
        self._turns: list[_Turn] = []
        # Of claimants with a turn, and waiting ones.
        self._active: Counter[str] = Counter()
        self._given: dict[str, int] = {}

    @asynccontextmanager
    async def room(self, claimant: str, pixels: int) -> AsyncIterator[None]:
        """Wait for room, and take it until the block ends.

        Parameters
        ----------
        claimant
            A user or an address.
        """
        turn = _Turn(claimant, min(pixels, self.most), asyncio.Event())
        # A new claimant is not owed what others got before.
        self._given.setdefault(claimant, min(self._given.values(), default=0))
        self._active[claimant] += 1
        self._turns.append(turn)
        self._begin_next()
        try:
            await turn.begun.wait()
            yield
        finally:
            self._end(turn)
            self._begin_next()

    def _end(self, turn: _Turn) -> None:
        if turn.begun.is_set():
            self._taken -= turn.pixels
        else:
            self._turns.remove(turn)
        self._active[turn.claimant] -= 1
        if not self._active[turn.claimant]:
            del self._active[turn.claimant], self._given[turn.claimant]

    def _begin_next(self) -> None:
        while turn := self._next(self._turns, self.most) or self._next_small():
            self._turns.remove(turn)
            self._taken += turn.pixels
            self._given[turn.claimant] += turn.pixels
            turn.begun.set()

    def _next_small(self) -> _Turn | None:
        small = [turn for turn in self._turns if turn.pixels <= self._small]
        return self._next(small, self.most + self._reserve)

    def _next(self, turns: Sequence[_Turn], most: int) -> _Turn | None:
        turn = min(turns, key=lambda turn: (self._given[turn.claimant], turn.pixels), default=None)
        return turn if turn is not None and self._taken + turn.pixels <= most else None


class RecentFiles:
    """Encoded pictures of unfinished jobs by their tags: the last small ones, and all that are being sent.

    Many watchers of a job request the same one. They take space on the disk, not in memory.
    """

    LAST, SMALL = 16, 4 << 20
    """Number and size of files that stay in memory when sent: a few tens of megabytes at most."""

    def __init__(self) -> None:
        self._of_tag: WeakValueDictionary[str, Stored] = WeakValueDictionary()
        self._last: deque[Stored] = deque(maxlen=self.LAST)

    def get(self, tag: str) -> Stored | None:
        """Find a file."""
        return self._of_tag.get(tag)

    def keep(self, tag: str, file: Stored) -> None:
        """Enter a file."""
        self._of_tag[tag] = file
        if file.size <= self.SMALL:
            self._last.append(file)


class BodyMemoryLimit:
    """Bounds the bytes of all bodies in memory. Used by one thread, that of the event loop.

    Parameters
    ----------
    most : int
        Bytes of all of them, which clients share.
    """

    def __init__(self, most: int) -> None:
        self._room = SharedRoom(most)

    @contextmanager
    def account(self, claimant: str) -> Iterator[Callable[[int], None]]:
        """Return a function that counts bytes of one body until the block ends; it may raise BusyError."""
        held = 0

        def add(count: int) -> None:
            nonlocal held
            if not self._room.take(claimant, count):
                raise BusyError("The service holds too many requests. Try again in a moment.")
            held += count

        try:
            yield add
        finally:
            self._room.give_back(claimant, held)


class UploadCount:
    """Counts the bytes of each user's uploads under way. Used by one thread, that of the event loop."""

    def __init__(self) -> None:
        self._bytes_of: Counter[str] = Counter()

    def bytes_of(self, principal: Principal) -> int:
        """Bytes of a user that have arrived and are not entered yet."""
        return self._bytes_of[principal.name]

    @contextmanager
    def counting(self, principal: Principal) -> Iterator[Callable[[int], None]]:
        """Return a function that counts bytes of one upload until the block ends."""
        held = 0

        def add(count: int) -> None:
            nonlocal held
            held += count
            self._bytes_of[principal.name] += count

        try:
            yield add
        finally:
            self._bytes_of[principal.name] -= held
            if not self._bytes_of[principal.name]:
                del self._bytes_of[principal.name]
