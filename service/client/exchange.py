"""What clients of every kind share: errors of the transport, refusals, and when to send again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

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


def checked_address(server: str) -> str:
    """Give an address back that may be that of a server; raise UnreachableError for any other."""
    try:
        url = httpx2.URL(server)
    except httpx2.InvalidURL:
        url = httpx2.URL()
    if url.scheme not in {"http", "https"} or not url.host:
        raise UnreachableError(
            f"{server!r} is not the address of a server. Write it like http://127.0.0.1:8000."
        )
    return server


@contextmanager
def transport_errors(server: str, *, job_id: str | None = None) -> Iterator[None]:
    """Turn errors of the HTTP library into errors of this client."""
    try:
        yield
    except (httpx2.ConnectError, httpx2.ConnectTimeout) as error:
        raise UnreachableError(f"There is no server at {server} ({error}).", sent=False) from error
    except httpx2.TimeoutException as error:
        about = f" about job {job_id}" if job_id else ""
        raise TimedOutError(f"{server} did not answer in time{about}.", job_id=job_id) from error
    except httpx2.TransportError as error:
        raise UnreachableError(f"The connection to {server} broke ({error}).") from error


def check(answer: httpx2.Response, call: Call[Any]) -> httpx2.Response:
    """Give the answer back, or raise what it says went wrong."""
    if answer.is_success or (call.may_be_missing and answer.status_code == 404):
        return answer
    raise refused(answer)


def refused(answer: httpx2.Response) -> ClientError:
    """The exception that an answer with a status of 300 and above stands for; its body has been read."""
    media_type = answer.headers.get("Content-Type", "").partition(";")[0]
    if media_type != "application/problem+json":
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code}, and not in the words of this service."
        )
    try:
        document = ProblemDocument.model_validate_json(answer.content)
    except ValidationError:
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code} with a broken problem document"
        )
    return refusal(answer.status_code, document, retry_after=_seconds(answer.headers.get("Retry-After")))


def repeat_after(call: Call[Any], patience: float) -> Callable[[Exception], bool | float]:
    """What to do after a failure: False to give up, True to repeat soon, or the seconds to wait before.

    A request that never left, or that the server refused for the moment, has done nothing, so any may be
    repeated then; after a broken connection only one that may be sent twice.
    """

    def decide(error: Exception) -> bool | float:
        match error:
            case RefusedError(retry_after=float(seconds)):
                return seconds if seconds <= patience else False
            case UnreachableError(sent=sent):
                return call.repeatable or not sent
            case _:
                return False

    return decide


def _seconds(header: str | None) -> float | None:
    try:
        return None if header is None else float(header)
    except ValueError:
        return None
