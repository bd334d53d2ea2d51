"""The parts of a service: put together, started and stopped."""

from __future__ import annotations

import os

from anyio import CapacityLimiter

from service.access.credential_cache import CredentialCache
from service.dispatch.dispatcher import Dispatcher
from service.dispatch.job_events import JobEvents
from service.dispatch.notifications import NotificationListener
from service.jobs import retention
from service.jobs.concurrency import BodyMemoryLimit, ConcurrencyLimit
from service.jobs.context import Service
from service.jobs.pricing import QuotedPrices
from service.jobs.retention import RetentionThread
from service.settings import Settings
from service.storage.assets import AssetStore
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.passes import PassStore
from service.storage.places import ASSETS, JOBS, place_of
from service.storage.tiles import TileStore
from service.telemetry.spans import SILENT, Telemetry
from service.workers.engines import engine_of
from service.workers.heartbeats import Lease
from service.workers.worker import WorkerSetup

BODIES = 16
"""As many requests with the largest scene are held in memory at once, or more smaller ones."""
READERS = 4
"""Documents that are read at once: the largest take some hundred megabytes each, and Python reads one."""


def started(settings: Settings, job_events: JobEvents, telemetry: Telemetry) -> Service:
    """Put a service together and start it."""
    service = assemble(settings, job_events, telemetry=telemetry)
    service.dispatcher.start()
    service.retention_thread.start()
    service.notifications.start()
    return service


def stop(service: Service) -> None:
    """Stop all that was started, and close the database."""
    service.retention_thread.stop()
    service.notifications.stop()
    service.dispatcher.stop()
    service.database.close()


def assemble(
    settings: Settings,
    job_events: JobEvents,
    store: TileStore | None = None,
    *,
    telemetry: Telemetry = SILENT,
) -> Service:
    """Put a service together, with a database of this version; nothing runs yet.

    Parameters
    ----------
    store
        Keeps the pixels; by default where the settings say.
    telemetry
        Takes spans; by default nobody does.
    """
    database = Database(settings.database_url)
    upgrade(database)
    place = place_of(settings.place)
    store = store or TileStore(place.within(JOBS))
    assets = AssetStore(place.within(ASSETS), settings.limits)
    engine = engine_of(settings, _setup(settings))
    spans = telemetry.of_jobs(database)
    dispatcher = Dispatcher(database, store, engine, job_events, settings, spans)
    return Service(
        settings=settings,
        database=database,
        store=store,
        passes=PassStore(store.objects),
        assets=assets,
        dispatcher=dispatcher,
        retention_thread=RetentionThread(database, store, assets, retention.rules_of(settings)),
        job_events=job_events,
        quote_limit=ConcurrencyLimit(settings.max_quotes, "quotes"),
        comparison_limit=ConcurrencyLimit(settings.max_comparisons, "comparisons"),
        prices=QuotedPrices(),
        credentials=CredentialCache(database),
        notifications=NotificationListener(database, dispatcher, job_events),
        spans=spans,
        body_memory=BodyMemoryLimit(
            max(BODIES * settings.limits.max_body_bytes, settings.trace_limits.max_body_bytes)
        ),
        readers=CapacityLimiter(READERS),
    )


def _setup(settings: Settings) -> WorkerSetup:
    return WorkerSetup(
        parent=os.getpid(),
        store=settings.place,
        limits=settings.limits,
        memory_bytes=settings.worker_memory_bytes,
        lease=Lease(silent_seconds=settings.worker_silence_seconds, task_seconds=settings.max_task_seconds),
        log_level=settings.log_level,
        workers=settings.workers,
    )
