"""The parts of a running service, and the dependency that gives them to routes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, ParamSpec, TypeVar

from anyio import CapacityLimiter, fail_after, to_thread
from fastapi import Depends, Request

from service.access.credentials import CredentialCache
from service.dispatch.dispatcher import Dispatcher
from service.dispatch.job_events import JobEvents
from service.dispatch.notifications import NotificationListener
from service.errors import UnavailableError
from service.jobs.pricing import QuotedPrices
from service.jobs.request_limits import (
    BodyMemoryLimit,
    PixelLimit,
    Readers,
    RecentFiles,
    StreamLimit,
    UploadCount,
)
from service.jobs.retention import RetentionThread
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.connection import BUSY_SECONDS, Database, patience
from service.storage.reserve import Reserve
from service.storage.tiles import TileStore
from service.telemetry.spans import JobSpans
from service.workers.engines import Engine

P = ParamSpec("P")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Service:
    """The parts of a running service."""

    settings: Settings
    database: Database
    store: TileStore
    assets: AssetStore
    reserve: Reserve
    engine: Engine
    dispatcher: Dispatcher
    retention_thread: RetentionThread
    job_events: JobEvents
    prices: QuotedPrices
    credentials: CredentialCache
    notifications: NotificationListener
    spans: JobSpans
    body_memory: BodyMemoryLimit
    readers: Readers
    writers: CapacityLimiter
    probes: CapacityLimiter
    streams: StreamLimit
    uploads: UploadCount
    encoding: PixelLimit
    unfinished: RecentFiles

    async def read(
        self, user: str, function: Callable[P, Answer], *args: P.args, **kwargs: P.kwargs
    ) -> Answer:
        """Call a function that reads a user's document in a thread, few at once: it may take much memory."""
        async with self.readers.of(user):
            return await to_thread.run_sync(partial(function, *args, **kwargs), limiter=self.readers.limiter)

    async def write(self, function: Callable[P, Answer], *args: P.args, **kwargs: P.kwargs) -> Answer:
        """Call a function that writes to the database in a thread; those who wait for their turn hold none.

        Raises
        ------
        UnavailableError
            If others were writing as long as a transaction may wait.
        """
        writing = partial(function, *args, **kwargs)
        try:
            with fail_after(BUSY_SECONDS), patience(BUSY_SECONDS):
                return await to_thread.run_sync(writing, limiter=self.writers)
        except TimeoutError:
            raise UnavailableError("The database is busy. Try again in a moment.") from None


async def _service(request: Request) -> Service:
    # Asynchronous, so that no thread is waited for: all may be busy.
    service = request.app.state.service
    assert isinstance(service, Service)
    return service


Here = Annotated[Service, Depends(_service)]
