"""What takes more than one request: written once, as generators that yield calls and are sent the answers.

A client of either kind drives them; a refusal is thrown into the generator where its call was yielded.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

from schemas.errors import SceneError
from schemas.jobs import Job
from schemas.plans import PlanDocument
from schemas.quotes import Quote
from schemas.request_pointers import in_scene
from schemas.traces import TraceAnswer
from service.client import calls
from service.client.calls import Answer, Call
from service.client.documents import sendable
from service.client.errors import RequestInvalidError
from service.client.parcels import Parcel

Result = TypeVar("Result")
Flow = Generator[Call[Any], Any, Result]


def given(**members: Any) -> dict[str, Any]:
    """What a request has beside its scene: only what was given, so that older services accept it too."""
    return {name: value for name, value in sendable(members).items() if value not in (None, [], {})}


def submission(
    parcel: Parcel, members: Mapping[str, Any], *, wait: float, key: str | None, anew: bool
) -> Flow[Job]:
    """Ask for a render; what the service warns of is told in the user's own document."""
    call = calls.submit_job(_body(parcel, members), wait=wait, key=key, anew=anew)
    job = yield from _asking(parcel, call)
    return job.model_copy(update={"warnings": tuple(parcel.placed(job.warnings))})


def plan(parcel: Parcel, members: Mapping[str, Any]) -> Flow[PlanDocument]:
    """What would run for a scene."""
    return in_scene((yield from _asking(parcel, calls.make_plan(_body(parcel, members)))))


def quote(parcel: Parcel, members: Mapping[str, Any]) -> Flow[Quote]:
    """What a scene would cost."""
    return in_scene((yield from _asking(parcel, calls.make_quote(_body(parcel, members)))))


def traces(parcel: Parcel, rays: Mapping[str, Any]) -> Flow[TraceAnswer]:
    """What rays hit."""
    return _asking(parcel, calls.trace(_body(parcel, sendable(rays))))


def _asking(parcel: Parcel, call: Call[Answer]) -> Flow[Answer]:
    """Upload what the server does not have, then send what is about it."""
    for sha256, content in parcel.contents.items():
        if not (yield calls.has_asset(sha256)):
            yield calls.put_asset(sha256, content)
    with _placing(parcel):
        answer: Answer = yield call
    return answer


def _body(parcel: Parcel, members: Mapping[str, Any]) -> dict[str, Any]:
    return {"scene": parcel.document, **members}


@contextmanager
def _placing(parcel: Parcel) -> Iterator[None]:
    """Let a refusal speak of the user's own document, not of the body that was made from it."""
    try:
        yield
    except RequestInvalidError as error:
        if not error.errors:
            raise
        placed = SceneError(parcel.placed(error.errors), error.document.more)
        told = {"errors": placed.errors, "detail": str(placed)}
        raise RequestInvalidError(error.status, error.document.model_copy(update=told)) from error
