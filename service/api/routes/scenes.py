"""Scenes without a job: plans, traces, and the schema of the language."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from schemas.jobs import JobRequest
from schemas.json_schema import scene_json_schema
from schemas.manifest_json_schema import manifest_json_schema
from schemas.plans import PlanDocument
from schemas.traces import TraceAnswer, TraceRequest
from service.analyses import traces
from service.api.authentication import CurrentUser
from service.api.bodies import JsonBody, TraceBody
from service.api.routes.jobs import BODY
from service.api.routes.parameters import json_request, problem
from service.jobs.admission import admit
from service.jobs.context import Here

router = APIRouter(prefix="/v1", tags=["scenes"])

UNUSABLE = problem(422, "The request cannot be used; every reason is listed.")


@router.post("/plans", responses=BODY | UNUSABLE, openapi_extra=json_request(JobRequest))
async def plan(here: Here, user: CurrentUser, body: JsonBody) -> PlanDocument:
    """Explain what would run for a scene, who asked for it, and what it would cost."""
    return (await here.read(admit, here, user, body)).description


@router.post(
    "/traces",
    responses=BODY | UNUSABLE | problem(503, "Too many others are tracing, or it took too long."),
    openapi_extra=json_request(TraceRequest),
)
async def trace(here: Here, user: CurrentUser, body: TraceBody) -> TraceAnswer:
    """Cast rays into a scene and say what each of them hits."""
    return await traces.trace(here, user, body)


@router.get("/schemas/scene.json", response_model=None)
def scene_schema() -> dict[str, Any]:
    """Get the JSON Schema of scenes."""
    return scene_json_schema()


@router.get("/schemas/manifest.json", response_model=None)
def manifest_schema() -> dict[str, Any]:
    """Get the JSON Schema of the manifests of assignments."""
    return manifest_json_schema()
