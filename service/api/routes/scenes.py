"""Routes that create no job: plans, traces, quotes, JSON Schemas, comparisons, inspected pixels."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from schemas.api.comparisons import ComparisonAnswer, ComparisonRequest
from schemas.api.inspections import Inspection, InspectionRequest, TraceAnswer, TraceRequest
from schemas.api.jobs import JobRequest
from schemas.api.plans import PlanDocument, Quote, QuoteRequest
from schemas.grading.manifest_reading import manifest_json_schema
from schemas.json_schema import scene_json_schema
from service.analyses import calls, comparisons
from service.api.authentication import CurrentUser, JobId
from service.api.bodies import JsonBody, TraceBody
from service.api.routes.jobs import BODY, GONE, UNKNOWN
from service.api.routes.parameters import json_request, problem
from service.jobs.admission import WHITE, admit
from service.jobs.context import Here

router = APIRouter(prefix="/v1", tags=["scenes"])
picture_router = APIRouter(prefix="/v1", tags=["pictures"])

UNUSABLE = problem(422, "The request cannot be used; every reason is listed.")


@router.post("/plans", responses=BODY | UNUSABLE, openapi_extra=json_request(JobRequest))
async def plan(here: Here, user: CurrentUser, body: JsonBody) -> PlanDocument:
    """Explain what would run for a scene, which parts of the scene require it, and what it would cost."""
    return (await here.read(admit, here, user, body)).description


@router.post(
    "/traces",
    responses=BODY | UNUSABLE | problem(503, "Too many traces are running, or this one took too long."),
    openapi_extra=json_request(TraceRequest),
)
async def trace(here: Here, user: CurrentUser, body: TraceBody) -> TraceAnswer:
    """Cast rays into a scene and report what each of them hits."""
    return await calls.trace(here, user, body)


@router.get("/schemas/scene.json", response_model=None)
def scene_schema() -> dict[str, Any]:
    """Get the JSON Schema of scenes."""
    return scene_json_schema()


@router.get("/schemas/manifest.json", response_model=None)
def manifest_schema() -> dict[str, Any]:
    """Get the JSON Schema of the manifests of assignments."""
    return manifest_json_schema()


QUOTED_SCENE = {
    "scene": {
        "version": 1,
        "camera": {
            "position": [0, 0, 3],
            "look_at": [0, 0, 0],
            "vertical_fov": 45,
            "width": 320,
            "height": 240,
        },
        "ambient": [1, 1, 1],
        "materials": {"red": {"type": "phong", "color": [0.8, 0.1, 0.1], "ambient": 0.5}},
        "shapes": [{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "red"}],
        "lights": [{"type": "point", "position": [2, 3, 4], "color": [0.8, 0.8, 0.8]}],
    },
    "target_error": 0.004,
    "seconds": 10,
}


def _about(estimate: float, low: float, high: float) -> dict[str, float]:
    return {"estimate": estimate, "low": low, "high": high}


SOBOL = {
    "quality": {
        "mode": "fixed",
        "antialiasing": {"pattern": "sobol", "samples": 16},
        "light": {"pattern": "sobol", "samples": 4},
    },
    "cpu_seconds": _about(2.1, 1.8, 2.4),
    "seconds": _about(0.53, 0.45, 0.6),
    "error": _about(0.0031, 0.0024, 0.0037),
}
TARGET = {
    "quality": {"mode": "target", "error": 0.004},
    "cpu_seconds": _about(0.9, 0.6, 1.4),
    "seconds": _about(0.25, 0.17, 0.39),
    "error": _about(0.0028, 0.0012, 0.004),
}
OFFERS: dict[str, Any] = {
    "asked": SOBOL,
    "offers": [SOBOL, TARGET],
    "for_error": TARGET,
    "for_seconds": TARGET | {"quality": {"mode": "target", "error": 0.00066, "time_limit": 10}},
    "effects": [{"effect": "light 0", "pointers": ["/scene/lights/0"], "cpu_seconds": 1.2, "share": 0.57}],
    "price": {"camera_rays": 1228800, "shadow_rays": 1228800, "cpu_seconds": 1.7},
    "workers": 4,
    "pilot": {"seconds": 1.38, "blocks": 20, "pixels": 4800, "target_errors": 2},
}


@router.post(
    "/quotes",
    responses={200: {"content": {"application/json": {"example": OFFERS}}}}
    | BODY
    | problem(422, "The request cannot be used; every reason is listed.")
    | problem(429, "Too many quotes are in progress.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(QuoteRequest, QUOTED_SCENE),
)
async def quote(here: Here, user: CurrentUser, body: JsonBody) -> Quote:
    """Predict the cost and the error of a scene at several qualities. This takes about 1.5 s."""
    return await calls.quote(here, user, body)


PICTURES: dict[str, Any] = {"image": {"content": WHITE}, "reference": {"content": WHITE, "encoding": "srgb"}}


@picture_router.post(
    "/comparisons",
    responses=BODY
    | problem(422, "The request, or one of its pictures, cannot be used; every reason is listed.")
    | problem(429, "Too many comparisons are in progress.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(ComparisonRequest, PICTURES),
)
async def compare(here: Here, user: CurrentUser, body: JsonBody) -> ComparisonAnswer:
    """Compare two pictures, uploaded or of jobs: metrics, a verdict that allows for noise, causes."""
    return await comparisons.compare(here, user, body)


PIXEL: dict[str, Any] = {"x": 0, "y": 0}


@picture_router.post(
    "/jobs/{job_id}/inspections",
    responses=BODY
    | UNKNOWN
    | GONE
    | problem(422, "The request cannot be used, or the picture has no such pixel.")
    | problem(503, "No worker was free in time."),
    openapi_extra=json_request(InspectionRequest, PIXEL),
)
async def inspect(here: Here, job_id: JobId, body: JsonBody) -> Inspection:
    """Explain a pixel: what its ray hits, what each light adds there, what blocks the light."""
    return await calls.inspect(here, job_id, body)
