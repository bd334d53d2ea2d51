"""The convergence of a job, error against time: as JSON, as a table, or as a plot."""

from __future__ import annotations

import csv
import io
from functools import lru_cache
from typing import Literal

from accuracy.convergence_plot import draw
from renderer.convergence import trend
from schemas.api.jobs import JobState
from schemas.api.plans import Convergence
from service.jobs import lifecycle as jobs
from service.jobs.context import Service
from service.lifecycle.documents import passes_of, work_of
from service.storage.database.models import RenderRow

Form = Literal["json", "csv", "svg", "png"]

MEDIA_TYPES: dict[Form, str] = {
    "json": "application/json",
    "csv": "text/csv",
    "svg": "image/svg+xml",
    "png": "image/png",
}
"""The forms; the first is the default."""


def etag_of(service: Service, job_id: str, form: Form) -> str:
    """Return the current tag of the answer, without making it."""
    with service.database.reading() as session:
        row = jobs.find(session, job_id)
        return f'"{row.id}-{row.state.value}-{work_of(row)["last_seq"]}-convergence.{form}"'


def convergence(service: Service, job_id: str) -> Convergence:
    """Report the passes of a job and the convergence of its error."""
    with service.database.reading() as session:
        row = jobs.find(session, job_id)
        render, passes = row.render, passes_of(row)
    target_error = render.target_error if render else row.quality.get("error")
    return Convergence.model_validate(
        {
            "job": row.id,
            "state": row.state,
            "mode": "fixed" if target_error is None else "target",
            "target_error": target_error,
            "passes": passes,
            **trend(passes, _unknown(render)),
        }
    )


def _unknown(render: RenderRow | None) -> str | None:
    """Why no pass has an error; None if that is not known."""
    if render is None:
        return "The job ended before its picture was finished, or its picture has been deleted."
    if render.target_error is not None:
        return None
    running = "The passes are compared when the picture is finished."
    return render.error_unknown or (None if render.state is JobState.SUCCEEDED else running)


def encoded(found: Convergence, form: Form) -> bytes:
    """Make the answer.

    Raises
    ------
    MissingExtraError
        If it is a plot, and the library that draws it is not installed.
    """
    match form:
        case "json":
            return found.model_dump_json().encode()
        case "csv":
            return _table(found).encode()
        case "svg" | "png":
            return _drawn(found.model_dump_json(), form)


def _table(found: Convergence) -> str:
    """Write a row for each pass (RFC 4180); unknown values are empty."""
    kinds = list(found.passes[-1].rays) if found.passes else []
    ends = ("estimate", "low", "high")
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(
        ["pass_index", "seconds", "cpu_seconds"]
        + [f"rays_{kind}" for kind in kinds]
        + [f"error_{end}" for end in ends]
    )
    for entry in found.passes:
        error = [getattr(entry.error, end) if entry.error else "" for end in ends]
        rays = [entry.rays.get(kind, 0) for kind in kinds]
        writer.writerow([entry.pass_index, entry.seconds, entry.cpu_seconds, *rays, *error])
    return text.getvalue()


# A plot takes a quarter of a second of a processor, and its file some 20 KiB.
@lru_cache(maxsize=256)
def _drawn(document: str, form: Form) -> bytes:
    found = Convergence.model_validate_json(document)
    title = f"Job {found.job}, {found.state.value}"
    passes = [entry.model_dump() for entry in found.passes]
    return draw(passes, form=form, title=title, target=found.target_error, unknown=found.reason)
