"""Exchanges of several requests, as generators that yield calls and receive the responses.

A client of either kind drives them; a refusal is thrown into the generator where its call was yielded.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

from schemas.api.comparisons import ComparisonAnswer
from schemas.api.jobs import Job
from schemas.errors import SceneError
from service.client import calls
from service.client.calls import Answer, Call
from service.client.comparing import Sent
from service.client.errors import RequestInvalidError
from service.client.parcels import Parcel, sendable

Result = TypeVar("Result")
Flow = Generator[Call[Any], Any, Result]


def given(**members: Any) -> dict[str, Any]:
    """The given fields of a request; others are left out, so that older services accept it."""
    return {name: value for name, value in sendable(members).items() if value not in (None, [], {})}


def submission(
    parcel: Parcel, members: Mapping[str, Any], *, wait: float, key: str | None, anew: bool
) -> Flow[Job]:
    """Submit a job; the pointers of its warnings lead into the user's own document."""
    call = calls.submit_job({"scene": parcel.document, **members}, wait=wait, key=key, anew=anew)
    job = yield from _asking(parcel, call)
    return job.model_copy(update={"warnings": tuple(parcel.placed(job.warnings))})


def about_scene(
    parcel: Parcel, path: str, members: Mapping[str, Any], model: type[calls.Model]
) -> Flow[calls.Model]:
    """Ask about a scene without a job."""
    return _asking(parcel, calls.post(path, {"scene": parcel.document, **sendable(members)}, model))


def comparison(pictures: Mapping[str, Sent], options: Mapping[str, Any]) -> Flow[ComparisonAnswer]:
    """Compare two pictures, each of which may be uploaded first."""
    for picture in pictures.values():
        yield from _uploading(picture.contents)
    named = {role: picture.document for role, picture in pictures.items()}
    answer: ComparisonAnswer = yield calls.post(
        "/v1/comparisons", named | sendable(options), ComparisonAnswer
    )
    return answer


def _uploading(contents: Mapping[str, bytes]) -> Flow[None]:
    """Upload the contents that the server lacks."""
    for sha256, content in contents.items():
        if not (yield calls.has_asset(sha256)):
            yield calls.put_asset(sha256, content)


def _asking(parcel: Parcel, call: Call[Answer]) -> Flow[Answer]:
    """Upload the contents that the server lacks, then send the call."""
    yield from _uploading(parcel.contents)
    with _placing(parcel):
        answer: Answer = yield call
    return answer


@contextmanager
def _placing(parcel: Parcel) -> Iterator[None]:
    """Raise a refusal with pointers into the user's own document, not into the body made from it."""
    try:
        yield
    except RequestInvalidError as error:
        if not error.errors:
            raise
        placed = SceneError(parcel.placed(error.errors), error.document.more)
        update = {"errors": placed.errors, "detail": str(placed)}
        raise RequestInvalidError(error.status, error.document.model_copy(update=update)) from error
