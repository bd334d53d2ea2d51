"""Events that wake requests watching a job; the database stays the only truth."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress

EACH_SECONDS, MOST_SECONDS = 0.01, 0.5
"""Seconds for which events of a job are collected, per watcher after the first, and at most."""


class Watcher:
    """One waiting request. Events that arrive before it waits are not lost.

    A single watcher of a job is woken at once. With many watchers, events are collected for a while, because
    reading every tile for all of them would slow down rendering.
    """

    def __init__(self, job_events: JobEvents, job: str) -> None:
        self._job_events, self._job = job_events, job
        self._changed = asyncio.Event()

    def wake(self) -> None:
        """Wake the request."""
        self._changed.set()

    async def wait(self, seconds: float) -> bool:
        """Wait for events; False if none came in time, or immediately when the service stops."""
        if self._job_events.closed:
            return False
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._changed.wait()
                await asyncio.sleep(self._job_events.pause(self._job))
        arrived = self._changed.is_set() and not self._job_events.closed
        self._changed.clear()
        return arrived


class JobEvents:
    """Connects the dispatcher's thread with the requests that wait on the event loop.

    Made on the event loop that the requests run on.
    """

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._watchers: defaultdict[str, set[Watcher]] = defaultdict(set)
        self.closed = False

    @contextmanager
    def watch(self, job: str) -> Iterator[Watcher]:
        """Receive events of a job from now on. Begin before reading the database."""
        watcher = Watcher(self, job)
        self._watchers[job].add(watcher)
        try:
            yield watcher
        finally:
            self._watchers[job].discard(watcher)
            if not self._watchers[job]:
                del self._watchers[job]

    def pause(self, job: str) -> float:
        """Seconds that events of a job are collected before its watchers wake."""
        return 0.0 if self.closed else min(EACH_SECONDS * (len(self._watchers[job]) - 1), MOST_SECONDS)

    def publish(self, jobs: Iterable[str]) -> None:
        """Announce that these jobs have changed. May be called by any thread."""
        with suppress(RuntimeError):  # the loop is closed: no request waits any more
            self._loop.call_soon_threadsafe(self._wake, tuple(jobs))

    def publish_all(self) -> None:
        """Announce that any job may have changed. May be called by any thread."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(lambda: self._wake(tuple(self._watchers)))

    def close(self) -> None:
        """End all waiting, now and from now on."""
        self.closed = True
        self._wake(tuple(self._watchers))

    def _wake(self, jobs: tuple[str, ...]) -> None:
        for job in jobs:
            for watcher in self._watchers.get(job, ()):
                watcher.wake()
