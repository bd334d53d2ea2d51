"""The application: its parts put together, started and stopped."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Literal

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
from service.api import problems
from service.api.authentication import authenticate
from service.api.routes import (
    administration,
    assets,
    comparisons,
    convergence,
    jobs,
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
from service.assembly import started, stop
from service.dispatch.job_events import JobEvents
from service.settings import Settings
from service.telemetry import spans

DESCRIPTION = "Send a scene as JSON, watch its tiles arrive, fetch the picture by the job's id."
PUBLIC = (operations, page)
"""What anybody may ask."""
ROUTERS = (
    session,
    jobs,
    tiles,
    pictures,
    convergence,
    scenes,
    comparisons,
    assets,
    administration,
    operations,
    page,
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

    # The framework's own pages for the document load scripts from elsewhere.
    app = FastAPI(
        title="Penumbra",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        telemetry=telemetry.of_requests(),
    )
    problems.install(app, partial(allowed, [module.router for module in ROUTERS]))
    for module in ROUTERS:
        asked = [] if module in PUBLIC else [Depends(authenticate)]
        # Scripts of the page read its addresses themselves.
        checked = [] if module is page else [Depends(check_query)]
        answers = problem(422, "A parameter cannot be used.") | (REFUSED if asked else {})
        app.include_router(module.router, dependencies=asked + checked, responses=answers)
        app.include_router(heads_of(module.router), dependencies=asked + checked)
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
