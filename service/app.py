"""The ASGI application: builds its parts, starts and stops them."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache, partial
from threading import Lock
from typing import Any, Literal

from anyio import CapacityLimiter
from fastapi import Depends, FastAPI
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from schemas.api.administration import KeyRequest, PruneRequest
from schemas.api.comparisons import ComparisonRequest
from schemas.api.inspections import InspectionRequest, TraceRequest
from schemas.api.jobs import JobRequest, Region
from schemas.api.plans import QuoteRequest
from schemas.api.previews import PreviewRequest
from schemas.errors import ProblemDocument
from service.access.credentials import CredentialCache
from service.api import problems
from service.api.authentication import authenticate
from service.api.middleware import OriginForm, TrustedProxies, Turns
from service.api.routes import (
    assets,
    jobs,
    keys,
    operations,
    page,
    pictures,
    scenes,
    session,
    tiles,
)
from service.api.routes.parameters import COMPONENTS, problem
from service.api.routes.routing import allowed, check_query, heads_of
from service.api.routes.session import REFUSED
from service.dispatch.dispatcher import Dispatcher
from service.dispatch.job_events import JobEvents
from service.dispatch.notifications import NotificationListener
from service.jobs import retention
from service.jobs.context import Service
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
from service.storage.database.connection import Database
from service.storage.database.migrations import upgrade
from service.storage.folder import ASSETS, JOBS, place_of
from service.storage.reserve import Reserve
from service.storage.tiles import TileStore
from service.telemetry import spans
from service.telemetry.spans import SILENT, Telemetry
from service.workers.engines import engine_of
from service.workers.heartbeats import Lease
from service.workers.worker import WorkerSetup

DESCRIPTION = "Send a scene as JSON, watch its tiles arrive, fetch the picture by the job's id."

MAX_BODIES = 16
"""Requests with the largest scene that are held in memory at once; smaller ones may be more."""
MAX_READERS = 4
"""Documents parsed concurrently: the largest take some hundred megabytes, and Python parses one at a time."""
MAX_WRITERS = 8
"""Concurrent writing requests: the database runs one at a time, and each may first wait for the store."""

ENCODED_PIXELS = 1 << 24
"""Pixels of the pictures that are encoded at once, of which PNG files take 4 bytes each in memory."""
MAX_PROBES = 2
"""Concurrent readiness checks, which have threads of their own: all others may be busy."""

LOOPBACK = "127.0.0.1 ::1"
"""Trusted proxies by default: those of this machine."""

PUBLIC = (operations.router, page.router)
"""Routers without authentication."""

ROUTERS = (
    session.router,
    keys.router,
    jobs.router,
    tiles.router,
    pictures.router,
    pictures.convergence_router,
    scenes.router,
    scenes.picture_router,
    assets.router,
    operations.staff_router,
    operations.router,
    page.router,
)


def create_app(settings: Settings) -> FastAPI:
    """Make the application; its parts start when its server does, and stop with it.

    Unless they share a database that can be shared, no other service may use the data folder meanwhile: two
    dispatchers would hand out the same tiles. ``service.server.run`` sees to that.
    """
    telemetry = spans.begin()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        service = await run_in_threadpool(started, settings, JobEvents(), telemetry)
        app.state.service = service
        try:
            yield
        finally:
            service.job_events.close()
            await run_in_threadpool(stop, service)
            await run_in_threadpool(telemetry.close)

    # The framework writes the document anew each time, and its own pages for it load scripts from elsewhere.
    app = FastAPI(
        title="Penumbra",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        telemetry=telemetry.of_requests(),
        # It would redirect to the host of the request; unknown addresses are redirected to a path alone.
        redirect_slashes=False,
    )
    app.add_middleware(OriginForm)
    app.add_middleware(Turns)
    app.add_middleware(TrustedProxies, trusted=(settings.trusted_proxies or LOOPBACK).split())
    problems.install(app, partial(allowed, ROUTERS), page.missing)
    for router in ROUTERS:
        is_public = router in PUBLIC
        dependencies = [] if is_public else [Depends(authenticate)]
        # Scripts of the page read its addresses themselves.
        dependencies += [] if router is page.router else [Depends(check_query)]
        answers = problem(422, "A parameter cannot be used.", "parameters") | ({} if is_public else REFUSED)
        app.include_router(router, dependencies=dependencies, responses=answers)
        app.include_router(heads_of(router), dependencies=dependencies)
    _document_bodies(app)
    return app


def _document_bodies(app: FastAPI) -> None:
    """Add what routes read and answer by themselves to the OpenAPI document."""
    generate = app.openapi
    read: list[tuple[type[BaseModel], Literal["validation"]]] = [
        (model, "validation")
        for model in (
            JobRequest,
            QuoteRequest,
            PreviewRequest,
            TraceRequest,
            ComparisonRequest,
            InspectionRequest,
            PruneRequest,
            KeyRequest,
            Region,
            ProblemDocument,
        )
    ]

    # Several threads may ask for the first time at once.
    building = Lock()

    @cache
    def build() -> dict[str, Any]:
        document = generate()
        _, definitions = models_json_schema(read, ref_template=COMPONENTS)
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        for name, schema in definitions["$defs"].items():
            schemas.setdefault(name, schema)
        return document

    def openapi() -> dict[str, Any]:
        with building:
            return build()

    app.openapi = openapi  # type: ignore[method-assign]


def started(settings: Settings, job_events: JobEvents, telemetry: Telemetry) -> Service:
    """Assemble a service and start it."""
    service = assemble(settings, job_events, telemetry=telemetry)
    service.dispatcher.start()
    service.retention_thread.start()
    service.notifications.start()
    service.credentials.start()
    return service


def stop(service: Service) -> None:
    """Stop all parts of a service, and close its database."""
    service.retention_thread.stop()
    service.notifications.stop()
    service.dispatcher.stop()
    service.credentials.stop()
    service.database.close()


def assemble(
    settings: Settings,
    job_events: JobEvents,
    store: TileStore | None = None,
    *,
    telemetry: Telemetry = SILENT,
) -> Service:
    """Assemble a service, with a database of this version; nothing runs yet.

    Parameters
    ----------
    store
        Keeps the pixels; by default where the settings say.
    telemetry
        Takes spans; by default they are dropped.
    """
    database = Database(settings.database_url)
    upgrade(database)
    place = place_of(settings.place)
    store = store or TileStore(place.within(JOBS))
    asset_store = AssetStore(place.within(ASSETS), settings.limits)
    engine = engine_of(settings, _setup(settings))
    reserve = Reserve(settings.data, database)
    job_spans = telemetry.of_jobs(database)
    dispatcher = Dispatcher(database, store, engine, job_events, settings, job_spans)
    return Service(
        settings=settings,
        database=database,
        store=store,
        assets=asset_store,
        engine=engine,
        dispatcher=dispatcher,
        retention_thread=RetentionThread(database, store, asset_store, retention.rules_of(settings), reserve),
        reserve=reserve,
        job_events=job_events,
        prices=QuotedPrices(),
        credentials=CredentialCache(database),
        notifications=NotificationListener(database, dispatcher, job_events),
        spans=job_spans,
        body_memory=BodyMemoryLimit(
            # One client may have half of them.
            2 * max(MAX_BODIES // 2 * settings.limits.max_body_bytes, settings.trace_limits.max_body_bytes)
        ),
        readers=Readers(MAX_READERS),
        writers=CapacityLimiter(MAX_WRITERS),
        probes=CapacityLimiter(MAX_PROBES),
        streams=StreamLimit(settings.max_user_streams, settings.max_connections),
        uploads=UploadCount(),
        encoding=PixelLimit(ENCODED_PIXELS),
        unfinished=RecentFiles(),
    )


def _setup(settings: Settings) -> WorkerSetup:
    return WorkerSetup(
        store=settings.place,
        limits=settings.limits,
        memory_bytes=settings.worker_memory_bytes,
        lease=Lease(silent_seconds=settings.worker_silence_seconds, task_seconds=settings.max_task_seconds),
        log_level=settings.log_level,
        workers=settings.workers,
    )
