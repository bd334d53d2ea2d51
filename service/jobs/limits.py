"""Limits on jobs and CPU seconds in the queue, on requests that are handled or wait, and on their memory."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from weakref import WeakValueDictionary

from anyio import CapacityLimiter
from sqlalchemy import bindparam, case, func, select
from sqlalchemy.orm import Session

import renderer
from schemas.errors import Problem
from service.access.principals import Principal
from service.errors import BusyError, QueueFullError
from service.settings import Settings
from service.storage.database.models import JobRow

_MINE = JobRow.owner == bindparam("owner")
_COUNTED = select(
    func.count(),
    func.coalesce(func.sum(JobRow.load), 0.0),
    func.coalesce(func.sum(case((_MINE, 1), else_=0)), 0),
    func.coalesce(func.sum(case((_MINE, JobRow.load), else_=0.0)), 0.0),
).where(JobRow.finished_at.is_(None))
# The longest Retry-After, seconds: by then other jobs may be cancelled.
LONGEST_WAIT = 3600.0


@dataclass(frozen=True)
class Share:
    """How much of a limit is used, by one user or by all."""

    name: str
    limit: float
    taken: float

    @property
    def left(self) -> float:
        """How much is left."""
        return max(0.0, self.limit - self.taken)


@dataclass(frozen=True)
class Queue:
    """How full the queue is for a user, and how many CPU seconds of it are rendered in a second."""

    jobs: Share
    cpu_seconds: Share
    rate: float

    def headers(self) -> dict[str, str]:
        """The queue as the headers of the IETF's draft on RateLimit."""
        shares = (self.jobs, "requests"), (self.cpu_seconds, "cpu-seconds")
        policy = ", ".join(f'"{share.name}";q={share.limit:.0f};qu="{unit}"' for share, unit in shares)
        left = ", ".join(f'"{share.name}";r={math.floor(share.left)}' for share, _ in shares)
        return {"RateLimit-Policy": policy, "RateLimit": left}


def check_queue(
    session: Session, settings: Settings, principal: Principal, job: JobRow, rate: float
) -> Queue:
    """Check that a job fits into the queue; one that is answered from the store always does.

    Parameters
    ----------
    rate
        CPU seconds that are rendered in a second.

    Raises
    ------
    QueueFullError
        Says when to try again.
    renderer.SceneError
        If it would not fit into an empty queue either.
    """
    jobs, seconds, my_jobs, my_seconds = session.execute(_COUNTED, {"owner": principal.name}).one()
    my_most = principal.max_jobs or settings.max_user_jobs
    # An earlier version has made keys with infinite limits, and none can be used beyond that of all jobs.
    mine = principal.max_cpu_seconds or settings.max_user_cpu_seconds
    my_most_seconds = min(settings.max_queued_cpu_seconds, mine)
    adds = 0 if job.state.final else 1
    shares = (
        Share("jobs", my_most, my_jobs + adds),
        Share("cpu", my_most_seconds, my_seconds + job.load),
        Share("all jobs", settings.max_queued_jobs, jobs + adds),
        Share("all cpu", settings.max_queued_cpu_seconds, seconds + job.load),
    )
    if job.load > my_most_seconds:
        _refuse_expensive(job.load, my_most_seconds)
    queue = Queue(shares[0], shares[1], rate)
    if adds:
        _refuse(queue, shares, job.predicted_cpu_seconds)
    return queue


def _refuse_expensive(cost: float, limit: float) -> None:
    """Refuse a job that would not fit into an empty queue."""
    detail = (
        f"This is predicted to take {cost:.3g} CPU seconds, more than the {limit:.3g} allowed for your jobs. "
        "Ask for fewer pixels, samples or light samples."
    )
    raise renderer.SceneError([Problem(pointer="/scene", detail=detail, code="cost")])


def _refuse(queue: Queue, shares: tuple[Share, ...], cost: float) -> None:
    full = [share for share in shares if share.taken > share.limit]
    if not full:
        return
    # There is room when work of about this cost has been rendered.
    excess = max(share.taken - share.limit if "cpu" in share.name else cost for share in full)
    wait = min(LONGEST_WAIT, max(1.0, excess / queue.rate))
    whose = "Your queue" if full[0].name in ("jobs", "cpu") else "The queue"
    amount = "CPU seconds" if "cpu" in full[0].name else "jobs"
    raise QueueFullError(
        f"{whose} is full: at most {full[0].limit:.0f} {amount}. Try again in {math.ceil(wait)} seconds.",
        {"Retry-After": str(math.ceil(wait))} | queue.headers(),
    )


class StreamLimit:
    """Bounds the requests of each user that wait for events. Used by one thread, that of the event loop.

    Each holds a connection. Without authentication all users are one, and there is no limit.

    Parameters
    ----------
    most : int
        Requests of one user.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._count_of: Counter[str] = Counter()

    def allows(self, principal: Principal) -> bool:
        """Whether another request of a user may wait."""
        return principal.is_everyone or self._count_of[principal.name] < self.most

    @contextmanager
    def waiting(self, principal: Principal) -> Iterator[None]:
        """Count a request until the block ends; BusyError if the user has too many."""
        if not self.allows(principal):
            raise BusyError(
                f"{self.most} of your requests wait, the maximum. Close a page or a program that watches one."
            )
        self._count_of[principal.name] += 1
        try:
            yield
        finally:
            self._count_of[principal.name] -= 1


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


class PixelLimit:
    """Bounds the pixels of the pictures that are encoded at once. Used by the event loop's thread alone.

    Parameters
    ----------
    most : int
        Pixels of all of them; a larger picture is encoded alone.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._taken = 0
        # They are served in the order in which they came: small pictures pass no large one.
        self._turn, self._freed = asyncio.Lock(), asyncio.Event()

    @asynccontextmanager
    async def room(self, pixels: int) -> AsyncIterator[None]:
        """Wait for room, and take it until the block ends."""
        wanted = min(pixels, self.most)
        async with self._turn:
            while self._taken + wanted > self.most:
                self._freed.clear()
                await self._freed.wait()
            self._taken += wanted
        try:
            yield
        finally:
            self._taken -= wanted
            self._freed.set()


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
    def account(self) -> Iterator[Callable[[int], None]]:
        """Return a function that counts bytes of one body until the block ends; it may raise BusyError."""
        held = 0

        def add(count: int) -> None:
            nonlocal held
            if self.bytes + count > self.most:
                message = "The service holds too many requests. Try again in a moment."
                raise BusyError(message)
            self.bytes += count
            held += count

        try:
            yield add
        finally:
            self.bytes -= held


class UploadCount:
    """Counts the bytes of each user's uploads under way. Used by one thread, that of the event loop."""

    def __init__(self) -> None:
        self._bytes_of: Counter[str] = Counter()

    def bytes_of(self, principal: Principal) -> int:
        """How many bytes of a user have arrived that are not entered yet."""
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
