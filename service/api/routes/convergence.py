"""The convergence of a job: error against time, while it runs and afterwards."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from schemas.convergence import Convergence
from service.analyses import convergence
from service.analyses.convergence import MEDIA_TYPES, Form
from service.api.routes.parameters import JobId, not_modified, problem
from service.jobs.context import Here

router = APIRouter(prefix="/v1/jobs/{job_id}", tags=["jobs"])

FormChoice = Annotated[
    Form | None, Query(alias="format", description="Form of the answer; without it `Accept` chooses.")
]
BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
EXAMPLE = {
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
RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The passes, how fast the error falls, and what half of it would cost. As CSV a row "
        "for each pass; as SVG or PNG a plot with logarithmic axes.",
        "model": Convergence,
        "content": {"application/json": {"example": EXAMPLE}}
        | {MEDIA_TYPES["csv"]: {"schema": {"type": "string"}}}
        | {MEDIA_TYPES[form]: BINARY for form in ("svg", "png")},
    },
    304: {"description": "Not changed."},
}


@router.get(
    "/convergence",
    response_class=Response,
    responses=RESPONSES
    | problem(404, "There is no such job.")
    | problem(501, "The service was installed without the extra `study`, which draws plots."),
)
def get_convergence(here: Here, request: Request, job_id: JobId, form: FormChoice = None) -> Response:
    """Get what the error of a picture costs: its passes, and what halving the error again would cost."""
    chosen = form or convergence.form_of(", ".join(request.headers.getlist("accept")))
    etag = convergence.etag_of(here, job_id, chosen)
    headers = {"ETag": etag, "Cache-Control": "no-cache", "Vary": "Accept"}
    return not_modified(request, etag) or Response(
        convergence.encoded(convergence.convergence(here, job_id), chosen),
        media_type=MEDIA_TYPES[chosen],
        headers=headers,
    )
