"""Routes that create no job: plans, traces, quotes, JSON Schemas, comparisons, inspected pixels."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response

from schemas.api.comparisons import ComparisonAnswer, ComparisonRequest
from schemas.api.inspections import Inspection, InspectionRequest, TraceAnswer, TraceRequest
from schemas.api.jobs import JobRequest
from schemas.api.plans import PlanDocument, Quote, QuoteRequest
from schemas.api.previews import PreviewRequest
from schemas.json_schema import scene_json_schema
from service.api.authentication import CurrentUser, JobId
from service.api.bodies import JsonBody, TraceBody, while_connected
from service.api.routes.jobs import BODY, GONE, UNKNOWN
from service.api.routes.parameters import json_request, problem
from service.calls import answers, comparisons
from service.jobs.admission import admit
from service.jobs.context import Here
from service.workers.planning import WHITE

router = APIRouter(prefix="/v1", tags=["scenes"])
picture_router = APIRouter(prefix="/v1", tags=["pictures"])


def _of_scene(failed: str) -> dict[int | str, dict[str, Any]]:
    """Describe the response to an unusable request, or one on which the renderer fails."""
    text = "The request cannot be used; `errors` lists every reason. Or the renderer failed on it."
    return problem(422, text, "scene_not_usable", failed)


NO_WORKER = problem(429, "Too many of your calls are in progress.", "busy") | problem(
    503, "No worker was free in time, or it died.", "unavailable", "worker_lost"
)


@router.post(
    "/plans",
    responses=BODY | _of_scene("plan_failed") | NO_WORKER,
    openapi_extra=json_request(JobRequest),
    summary="Explain a request",
    response_description="The plan.",
)
async def plan(request: Request, here: Here, user: CurrentUser, body: JsonBody) -> PlanDocument:
    """Explain what would run for a request, which parts of it require each stage, and the predicted cost."""
    admitted = await while_connected(request, admit(here, user, body))
    return admitted.description.model_copy(update={"warnings": admitted.warnings})


@router.post(
    "/traces",
    response_model=TraceAnswer,
    responses=BODY | _of_scene("trace_failed") | NO_WORKER,
    openapi_extra=json_request(TraceRequest),
    summary="Trace rays",
    response_description="One entry for each ray.",
)
async def trace(request: Request, here: Here, user: CurrentUser, body: TraceBody) -> Response:
    """Cast rays into a scene and report what each of them hits first."""
    answer = await while_connected(request, answers.trace(here, user, body))
    return Response(answer, media_type="application/json")


@router.get(
    "/schemas/scene.json",
    response_model=None,
    summary="Get the JSON Schema of scenes",
    response_description="The JSON Schema.",
)
def scene_schema() -> dict[str, Any]:
    """Get the JSON Schema of scenes, for editors and validators."""
    return scene_json_schema()


@router.get(
    "/schemas/manifest.json",
    response_model=None,
    summary="Get the JSON Schema of manifests",
    response_description="The JSON Schema.",
)
def manifest_schema() -> dict[str, Any]:
    """Get the JSON Schema of the manifests of assignments, for editors and validators."""
    from schemas.grading.manifest_reading import manifest_json_schema  # noqa: PLC0415  (of use to few services)

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
    | _of_scene("quote_failed")
    | NO_WORKER,
    openapi_extra=json_request(QuoteRequest, QUOTED_SCENE),
    summary="Predict cost and error",
    response_description="Several qualities with their predicted cost and error.",
)
async def quote(request: Request, here: Here, user: CurrentUser, body: JsonBody) -> Quote:
    """Predict the cost and the error of a scene at several qualities. This takes about 1.5 seconds."""
    return await while_connected(request, answers.quote(here, user, body))


@router.post(
    "/previews",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}} | BODY | _of_scene("preview_failed") | NO_WORKER,
    openapi_extra=json_request(PreviewRequest),
    summary="Preview a scene",
    response_description="A small PNG picture.",
)
async def preview(request: Request, here: Here, user: CurrentUser, body: JsonBody) -> Response:
    """Render a small picture of a scene while you wait. No job is created, and nothing is stored."""
    png = await while_connected(request, answers.preview(here, user, body))
    return Response(png, media_type="image/png")


PICTURES: dict[str, Any] = {"image": {"content": WHITE}, "reference": {"content": WHITE, "encoding": "srgb"}}


@picture_router.post(
    "/comparisons",
    responses=BODY
    | problem(
        422,
        "The request cannot be used, or its pictures cannot be compared: different sizes, NaN, transparency.",
        "scene_not_usable",
        "not_comparable",
        "comparison_failed",
    )
    | NO_WORKER,
    openapi_extra=json_request(ComparisonRequest, PICTURES),
    summary="Compare two pictures",
    response_description="Metrics, a verdict, and likely mistakes.",
)
async def compare(request: Request, here: Here, user: CurrentUser, body: JsonBody) -> ComparisonAnswer:
    """Compare two pictures, sent or of jobs: metrics, a verdict that allows for noise, likely mistakes."""
    return await while_connected(request, comparisons.compare(here, user, body))


PIXEL: dict[str, Any] = {"x": 0, "y": 0}


@picture_router.post(
    "/jobs/{job_id}/inspections",
    responses=BODY
    | UNKNOWN
    | GONE
    | problem(
        422,
        "The request cannot be used, or the picture has no such pixel.",
        "scene_not_usable",
        "inspection_failed",
    )
    | NO_WORKER,
    openapi_extra=json_request(InspectionRequest, PIXEL),
    summary="Inspect a pixel",
    response_description="What the ray hits, and why the pixel looks as it does.",
)
async def inspect(
    request: Request, here: Here, user: CurrentUser, job_id: JobId, body: JsonBody
) -> Inspection:
    """Trace the ray through the centre of a pixel: what it hits, what each light adds there, what blocks it.

    The job need not have begun. The pixel of the picture is the mean of many such rays.
    """
    return await while_connected(request, answers.inspect(here, user, job_id, body))
