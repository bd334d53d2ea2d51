"""The picture of a job and its layers, partial while it runs, and the convergence of its error."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import Response

from schemas.api.plans import Convergence
from service.api.authentication import JobId, claimant_of
from service.api.bodies import while_connected
from service.api.middleware import end_turn
from service.api.request_headers import check_preconditions
from service.api.routes.parameters import BINARY, CHANGED, negotiate, problem
from service.api.routes.stored import stored_response
from service.calls import convergence
from service.calls.convergence import MEDIA_TYPES, Form
from service.jobs import pictures
from service.jobs.context import Here, Service
from service.jobs.pictures import ImageRequest

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["pictures"])
convergence_router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])


class Width(IntEnum):
    """Widths of thumbnails, pixels. There are few, because each thumbnail is kept."""

    SMALL = 96
    SHARP = 192
    LARGE = 384


ThumbnailWidth = Annotated[
    Width | None,
    Query(description="Most columns of a thumbnail. Without it you get the whole picture."),
]
ShownEvent = Annotated[
    int | None,
    Query(
        ge=0,
        le=2**31 - 1,
        description="Any event's number. It does not change the picture, but the URL, so that browsers fetch "
        "it again.",
    ),
]
LayerPart = Annotated[str, Path(description="Name of the layer.", max_length=64)]


NO_JOB = problem(
    404,
    "There is no such job, or nothing of its picture is finished yet: then there is `Retry-After`.",
    "unknown_job",
    "picture_not_ready",
)
NO_LAYER = problem(
    404,
    "There is no such job or layer, or nothing of it is finished yet: then there is `Retry-After`.",
    "unknown_job",
    "unknown_layer",
    "picture_not_ready",
)


def _responses(kind: pictures.Kind) -> dict[int | str, dict[str, Any]]:
    content = {pictures.MEDIA_TYPES[kind]: BINARY}
    return (
        {
            200: {
                "content": content,
                "description": "The file. `X-Progress` is the share of samples in it, 1 when it is final.",
            }
        }
        | {
            206: {"content": content, "description": "The bytes that `Range` asked for."},
            304: {"description": "You have it already, by `If-None-Match` or `If-Modified-Since`."},
        }
        | NO_JOB
        | CHANGED
        | problem(
            410,
            "The job failed, was cancelled or has expired, or the stored file is damaged: submit it again.",
            "picture_gone",
            "picture_damaged",
        )
        | problem(416, "The range is outside the file.", "range")
    )


REVALIDATED = {"Cache-Control": "no-cache"}
NO_WIDTH = problem(422, "There are no thumbnails of this width.", "parameters")
NO_EXR = problem(501, "The service was installed without the extra `exr`.", "extra_missing")


@router.get(
    "/image.png",
    response_class=Response,
    responses=_responses("png") | NO_WIDTH,
    summary="Get the picture as PNG",
)
async def get_png(
    here: Here,
    request: Request,
    job_id: JobId,
    width: ThumbnailWidth = None,
    after: ShownEvent = None,  # noqa: ARG001  (part of the address alone)
) -> Response:
    """Get the picture as a PNG file with the scene's `display` applied, as far as it is finished."""
    return await _answer(here, request, job_id, ImageRequest("png", width=width))


@router.get(
    "/image.npy",
    response_class=Response,
    responses=_responses("npy"),
    summary="Get the picture as NumPy file",
)
async def get_npy(here: Here, request: Request, job_id: JobId) -> Response:
    """Get the linear picture as a NumPy file: float32, height x width x 3, row 0 at the top."""
    return await _answer(here, request, job_id, ImageRequest("npy"))


@router.get(
    "/image.exr",
    response_class=Response,
    responses=_responses("exr") | NO_EXR,
    summary="Get the picture as OpenEXR",
)
async def get_exr(here: Here, request: Request, job_id: JobId) -> Response:
    """Get the linear picture and all layers of the job in one OpenEXR file."""
    return await _answer(here, request, job_id, ImageRequest("exr"))


@router.get(
    "/layers/{name}.npy",
    response_class=Response,
    responses=_responses("npy") | NO_LAYER,
    summary="Get a layer",
)
async def get_layer(here: Here, request: Request, job_id: JobId, name: LayerPart) -> Response:
    """Get a layer of the request as a NumPy file: height x width, or height x width x channels.

    While the job runs, unfinished pixels look as if their ray hit nothing, and `X-Progress` is the share of
    finished ones. With target quality, `samples` and `error` come at the end.
    """
    return await _answer(here, request, job_id, ImageRequest("npy", name))


async def _answer(service: Service, request: Request, job_id: str, requested: ImageRequest) -> Response:
    try:
        return await while_connected(request, _look(service, request, job_id, requested))
    except FileNotFoundError:
        # The job has ended or was deleted meanwhile, or files were lost: a second look finds what there is.
        return await while_connected(request, _look(service, request, job_id, requested))


async def _look(service: Service, request: Request, job_id: str, requested: ImageRequest) -> Response:
    look = await run_in_threadpool(pictures.look, service, job_id, requested)
    picture = look.encoded
    if picture is None:
        # Before it is encoded, which takes longest.
        known = {"ETag": look.etag, **REVALIDATED} if look.etag else None
        unchanged = check_preconditions(request, known) if known else None
        if unchanged:
            return unchanged
        await end_turn(request.scope)
        async with service.encoding.room(claimant_of(request), look.pixels):
            picture = await run_in_threadpool(pictures.picture, service, job_id, requested)
    headers = {"ETag": picture.etag, "X-Progress": f"{picture.share:.4f}", **REVALIDATED}
    media_type = pictures.MEDIA_TYPES[requested.kind]
    return await run_in_threadpool(stored_response, request, picture.content, media_type, headers)


FormChoice = Annotated[
    Form | None, Query(alias="format", description="Format of the response. Without it, `Accept` chooses.")
]
CONVERGENCE_EXAMPLE = {
    "job": "5f0c7a1be2d94c36",
    "state": "running",
    "mode": "target",
    "target_error": 0.004,
    "passes": [
        {
            "pass_index": index,
            "seconds": seconds,
            "cpu_seconds": cpu_seconds,
            "rays": {"camera": camera, "shadow": 4 * camera, "mirror": 0, "transmission": 0},
            "error": {"estimate": error, "low": low, "high": high},
        }
        for index, (seconds, cpu_seconds, camera, error, low, high) in enumerate(
            (
                (0.6, 1.0, 65536, 0.032, 0.03104, 0.03296),
                (2.3, 4.0, 262144, 0.0157, 0.01523, 0.01617),
                (9.1, 16.0, 1048576, 0.0081, 0.00786, 0.00834),
            )
        )
    ],
    "order": {"estimate": -0.495, "low": -0.628, "high": -0.363},
    "next_halving": {
        "seconds": {"estimate": 27.8, "low": 7.05, "high": 120.0},
        "cpu_seconds": {"estimate": 48.8, "low": 12.4, "high": 211.0},
    },
}
CONVERGENCE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The passes, how fast the error falls, and what half of it would cost. CSV has a row "
        "for each pass, SVG and PNG are a plot with logarithmic axes.",
        "model": Convergence,
        "content": {"application/json": {"example": CONVERGENCE_EXAMPLE}}
        | {MEDIA_TYPES["csv"]: {"schema": {"type": "string"}}}
        | {MEDIA_TYPES[form]: BINARY for form in ("svg", "png")},
    },
    304: {"description": "It still has the `ETag` of `If-None-Match`."},
}


@convergence_router.get(
    "/convergence",
    response_class=Response,
    responses=CONVERGENCE
    | CHANGED
    | problem(404, "There is no such job.", "unknown_job")
    | problem(
        501, "The service was installed without the extra `study`, which draws plots.", "extra_missing"
    ),
    summary="Get error against time",
)
async def get_convergence(here: Here, request: Request, job_id: JobId, form: FormChoice = None) -> Response:
    """Get what each pass has cost, the error after it, and what half of that error would cost."""
    chosen = form or _form_of(request)
    etag = await run_in_threadpool(convergence.etag_of, here, job_id, chosen)
    headers = {"ETag": etag, "Vary": "Accept", **REVALIDATED}
    unchanged = check_preconditions(request, headers)
    if unchanged:
        return unchanged
    content = await while_connected(request, _convergence(here, request, job_id, chosen))
    return Response(content, media_type=MEDIA_TYPES[chosen], headers=headers)


async def _convergence(service: Service, request: Request, job_id: str, form: Form) -> bytes:
    found = await run_in_threadpool(convergence.convergence, service, job_id)
    if form in ("json", "csv"):
        return await run_in_threadpool(convergence.encoded, found, form)
    # One plot is drawn at a time, like the largest pictures: Python would not draw two in parallel.
    await end_turn(request.scope)
    async with service.encoding.room(claimant_of(request), service.encoding.most):
        return await run_in_threadpool(convergence.encoded, found, form)


def _form_of(request: Request) -> Form:
    forms = {media_type: form for form, media_type in MEDIA_TYPES.items()}
    return forms[negotiate(request, tuple(forms))]
