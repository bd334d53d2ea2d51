"""What clients of both kinds share: errors of the transport, refusals, and when to send again."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any, TypedDict

import httpx2
from pydantic import ValidationError

from schemas.problems import ProblemDocument
from service.client.calls import Call
from service.client.errors import (
    ClientError,
    RefusedError,
    TimedOutError,
    UnexpectedAnswerError,
    UnreachableError,
    refusal,
)

NOWHERE = {"line": None, "column": None}
SHORTEST_PAUSE = 0.1
"""Seconds between two requests, also where the server would have none."""


class Pauses(TypedDict):
    """How stamina waits between two requests."""

    attempts: None
    timeout: None
    wait_initial: float
    wait_max: float
    wait_jitter: float


PAUSES = Pauses(attempts=None, timeout=None, wait_initial=SHORTEST_PAUSE, wait_max=1.0, wait_jitter=0.1)
"""Whether there is another try at all is decided by `repeats`."""


def refuse_closed(closed: bool) -> None:
    """Refuse to send through a client that was closed.

    Raises
    ------
    ClientError
        Says so.
    """
    if closed:
        raise ClientError("This client is closed. Make another, or leave its 'with' statement later.")


@contextmanager
def transport_errors(server: str, *, job_id: str | None = None) -> Iterator[None]:
    """Turn errors of the HTTP library into errors of this client."""
    try:
        yield
    except (httpx2.ConnectError, httpx2.ConnectTimeout) as error:
        raise UnreachableError(
            f"There is no server at {server} ({error}). Start it, or name another by PENUMBRA_SERVER.",
            sent=False,
            job_id=job_id,
        ) from error
    except httpx2.TimeoutException as error:
        about = f" about job {job_id}" if job_id else ""
        raise TimedOutError(f"{server} did not answer in time{about}.", job_id=job_id) from error
    except httpx2.TransportError as error:
        raise UnreachableError(f"The connection to {server} broke ({error}).", job_id=job_id) from error


def check(answer: httpx2.Response, call: Call[Any]) -> httpx2.Response:
    """Give the answer back, or raise what it says went wrong."""
    if answer.is_success or (call.may_be_missing and answer.status_code == 404):
        return answer
    raise refused(answer)


def refused(answer: httpx2.Response) -> ClientError:
    """The exception that an answer with a status of 300 and above stands for; its body has been read."""
    retry_after = _seconds(answer.headers.get("Retry-After"))
    media_type = answer.headers.get("Content-Type", "").partition(";")[0]
    if media_type != "application/problem+json":
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code}, and not in the words of this service. "
            "Is that its address?",
            # A proxy in front of the service has no other words for this.
            retry_after=retry_after if answer.status_code in {429, 503} else None,
        )
    try:
        document = ProblemDocument.model_validate_json(answer.content)
    except ValidationError:
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code} with a broken problem document. Is that its address?"
        )
    # The body was made here: lines and columns of it are of no use to anybody, unless they are found anew.
    errors = tuple(problem.model_copy(update=NOWHERE) for problem in document.errors)
    return refusal(
        answer.status_code, document.model_copy(update={"errors": errors}), retry_after=retry_after
    )


def repeats(call: Call[Any], patience: float) -> Callable[[Exception], bool | float]:
    """What to do after each failure of a call: False to give up, True to repeat soon, or seconds to wait.

    A request that never left, or that the server refused for the moment, has done nothing, so any may be
    repeated then; after a broken connection only one that may be sent twice. Patience is counted from the
    first failure on, since the server may hold back an answer for longer than that.
    """
    end: float | None = None

    def decide(error: Exception) -> bool | float:
        nonlocal end
        now = time.monotonic()
        end = end or now + patience
        if now >= end:
            return False
        match error:
            case RefusedError(retry_after=float(seconds)) | UnexpectedAnswerError(retry_after=float(seconds)):
                return max(seconds, SHORTEST_PAUSE) if now + seconds <= end else False
            case UnreachableError(sent=sent):
                return call.repeatable or not sent
            case _:
                return False

    return decide


def _seconds(header: str | None) -> float | None:
    """Read ``Retry-After`` (RFC 9110): seconds, or a date."""
    if header is None:
        return None
    try:
        return max(0.0, float(header))
    except ValueError:
        pass
    try:
        when = parsedate_to_datetime(header)
    except ValueError:
        return None
    return max(0.0, (when.replace(tzinfo=when.tzinfo or UTC) - datetime.now(UTC)).total_seconds())
