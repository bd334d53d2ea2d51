"""The application: its parts put together, started and stopped."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Literal

from anyio import CapacityLimiter
from fastapi import Depends, FastAPI
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from schemas.comparisons import ComparisonRequest
from schemas.inspections import InspectionRequest
from schemas.jobs import JobRequest
from schemas.problems import ProblemDocument
from schemas.quotes import QuoteRequest
from schemas.regions import Region
from schemas.retention import PruneRequest
from schemas.traces import TraceRequest
from service import problems, retention
from service.access.asking import asker
from service.access.known import Known
from service.context import Service
from service.database.connection import Database
from service.database.migrations import upgrade
from service.dispatcher import Dispatcher
from service.engines.choosing import engine_of
from service.engines.heartbeats import Lease
from service.engines.worker import WorkerSetup
from service.feed import Feed
from service.held import Held
from service.keeper import Keeper
from service.prices import QuotedPrices
from service.relay import Relay
from service.routes import (
    assets,
    comparisons,
    convergence,
    focus,
    inspections,
    jobs,
    logs,
    metrics,
    operations,
    page,
    pictures,
    pins,
    prune,
    quotes,
    requests,
    scenes,
    session,
    tiles,
)
from service.routes.parameters import COMPONENTS, problem
from service.routes.session import REFUSED
from service.seats import Seats
from service.settings import Settings
from service.store.assets import AssetStore
from service.store.passes import PassStore
from service.store.tiles import FileTileStore

DESCRIPTION = "Send a scene as JSON, watch its tiles arrive, fetch the picture by the job's id."
PUBLIC = (operations, page)
"""What anybody may ask."""
ROUTERS = (
    session,
    jobs,
    requests,
    logs,
    tiles,
    pictures,
    convergence,
    focus,
    inspections,
    pins,
    scenes,
    quotes,
    comparisons,
    assets,
    prune,
    metrics,
    operations,
    page,
)


BODIES = 16
"""As many requests of the largest size are held in memory at once, or more smaller ones."""
READERS = 4
"""Documents that are read at once: the largest take some hundred megabytes each, and Python reads one."""


def create_app(settings: Settings) -> FastAPI:
    """Make the application; its parts start when its server does, and stop with it.

    Unless they share a database that can be shared, no other service may use the data folder meanwhile: two
    dispatchers would hand out the same tiles. ``service.server.run`` sees to that.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        service = await run_in_threadpool(_assemble, settings, Feed())
        app.state.service = service
        try:
            yield
        finally:
            service.feed.close()
            await run_in_threadpool(service.keeper.stop)
            await run_in_threadpool(service.relay.stop)
            await run_in_threadpool(service.dispatcher.stop)
            service.database.close()

    # The framework's own pages for the document load scripts from elsewhere.
    app = FastAPI(
        title="Penumbra",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
    )
    problems.install(app)
    for module in ROUTERS:
        asked = [] if module in PUBLIC else [Depends(asker)]
        answers = problem(422, "A parameter cannot be used.") | (REFUSED if asked else {})
        app.include_router(module.router, dependencies=asked, responses=answers)
    _document_bodies(app)
    return app


def _assemble(settings: Settings, feed: Feed) -> Service:
    database = Database(settings.database_url)
    upgrade(database)
    store = FileTileStore(settings.data / "jobs")
    textures = AssetStore(settings.data / "assets", settings.max_asset_pixels)
    keeper = Keeper(database, store, textures, retention.rules_of(settings))
    setup = WorkerSetup(
        parent=os.getpid(),
        jobs=store.folder,
        assets=textures.folder,
        max_asset_pixels=settings.max_asset_pixels,
        memory_bytes=settings.worker_memory_bytes,
        lease=Lease(silent_seconds=settings.worker_silence_seconds, task_seconds=settings.max_task_seconds),
        log_level=settings.log_level,
    )
    dispatcher = Dispatcher(database, store, engine_of(settings, setup), feed, settings)
    dispatcher.start()
    keeper.start()
    relay = Relay(database, dispatcher, feed)
    relay.start()
    return Service(
        settings=settings,
        database=database,
        store=store,
        passes=PassStore(store.folder),
        assets=textures,
        dispatcher=dispatcher,
        keeper=keeper,
        feed=feed,
        quote_seats=Seats(settings.max_quotes, "quotes"),
        comparison_seats=Seats(settings.max_comparisons, "comparisons"),
        prices=QuotedPrices(),
        known=Known(database),
        relay=relay,
        bodies=Held(BODIES * settings.limits.max_body_bytes),
        readers=CapacityLimiter(READERS),
    )


def _document_bodies(app: FastAPI) -> None:
    """Add what routes read and answer by themselves to the OpenAPI document."""
    generate = app.openapi
    read: list[tuple[type[BaseModel], Literal["validation"]]] = [
        (model, "validation")
        for model in (
            JobRequest,
            QuoteRequest,
            TraceRequest,
            ComparisonRequest,
            InspectionRequest,
            PruneRequest,
            Region,
            ProblemDocument,
        )
    ]

    def openapi() -> dict[str, Any]:
        document = generate()
        _, definitions = models_json_schema(read, ref_template=COMPONENTS)
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        for name, schema in definitions["$defs"].items():
            schemas.setdefault(name, schema)
        return document

    app.openapi = openapi  # type: ignore[method-assign]
