"""Comparisons of two pictures, computed by a worker while the client waits."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Iterator

import renderer
from accuracy.comparison.inputs import SIDECARS
from schemas.api.comparisons import ComparisonAnswer, ComparisonRequest, SentPicture
from schemas.api.jobs import JobState
from schemas.errors import Problem
from schemas.reading import read_document
from service.access.principals import Principal
from service.errors import UnknownJobError
from service.jobs import lifecycle as jobs
from service.jobs.admission import asset_problem, known_assets
from service.jobs.context import Service
from service.jobs.damaged_files import IMAGE
from service.jobs.worker_calls import ask_worker
from service.lifecycle import rows
from service.storage.assets import Kind
from service.storage.database.models import RenderRow
from service.workers import layers
from service.workers.tasks import ComparedPicture, CompareTask


async def compare(service: Service, principal: Principal, body: bytes) -> ComparisonAnswer:
    """Compare the two pictures of a request; raises as `ask_worker` does, also for an unusable picture."""
    answer: ComparisonAnswer
    _, answer = await ask_worker(service, principal, _task, body)
    return answer


def _task(service: Service, principal: Principal, body: bytes) -> CompareTask:
    request, _ = read_document(body, ComparisonRequest, limits=service.settings.limits)
    sent = {"image": request.image, "reference": request.reference}
    problems = [
        problem for role, picture in sent.items() for problem in _problems(service, principal, role, picture)
    ]
    if problems:
        raise renderer.SceneError(problems)
    image, reference = (_compared(service, principal, role, picture) for role, picture in sent.items())
    # Decoded pictures need not be sent twice.
    bare = request.model_copy(update={"image": SentPicture(), "reference": SentPicture()})
    return CompareTask(bare, image, reference, user=principal.name)


def _problems(service: Service, principal: Principal, role: str, picture: SentPicture) -> Iterator[Problem]:
    if [picture.job, picture.asset, picture.content].count(None) != 2:
        detail = "Give a picture either as 'job', as 'asset' or as 'content'."
        yield Problem(pointer=f"/{role}", detail=detail, code="one_of")
    elif picture.asset is not None:
        known = known_assets(service, principal, {picture.asset})
        problem = asset_problem(f"/{role}/asset", picture.asset, known, (Kind.PICTURE, Kind.ARRAY))
        yield from () if problem is None else (problem,)


def _compared(service: Service, principal: Principal, role: str, picture: SentPicture) -> ComparedPicture:
    if picture.job is None:
        content = _decoded(role, picture.content or "")
        return ComparedPicture(None, "", content, picture.encoding, (), asset=picture.asset)
    render = _rendered(service, principal, role, picture.job)
    names = tuple(name for name in SIDECARS if name in render.layers)
    files = (f"{render.final_prefix}{file}" for file in (IMAGE, *map(layers.file_name, names)))
    return ComparedPicture(
        picture.job,
        render.id,
        b"",
        picture.encoding,
        names,
        render.final_prefix,
        render.spec_sha256,
        {file: rows.expected(render, file) for file in files},
    )


def _decoded(role: str, content: str) -> bytes:
    try:
        return base64.b64decode(content, validate=True)
    except (binascii.Error, ValueError):
        detail = "This is not Base64. Send the bytes of the file in Base64, without line breaks."
        raise renderer.SceneError(
            [Problem(pointer=f"/{role}/content", detail=detail, code="base64")]
        ) from None


def _rendered(service: Service, principal: Principal, role: str, job_id: str) -> RenderRow:
    """Return the render of a finished job."""
    try:
        with service.database.reading() as session:
            jobs.owner_of(session, job_id, None if principal.sees_all else principal.name)
            row = jobs.find(session, job_id)
    except UnknownJobError as error:
        raise renderer.SceneError([_of_job(role, str(error))]) from None
    if row.render is None or row.state is not JobState.SUCCEEDED:
        raise renderer.SceneError([_of_job(role, f"This job has no complete picture; it is {row.state}.")])
    return row.render


def _of_job(role: str, detail: str) -> Problem:
    return Problem(pointer=f"/{role}/job", detail=detail, code="job_not_comparable")
