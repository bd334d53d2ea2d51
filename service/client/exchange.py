"""Transport errors, refusals, and when a request is retried."""

from __future__ import annotations

import logging
import random
import re
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

import httpx2
from pydantic import ValidationError

from schemas.errors import ProblemDocument
from service.client.calls import Call
from service.client.errors import (
    ClientError,
    RefusedError,
    TimedOutError,
    TLSError,
    UnexpectedAnswerError,
    UnreachableError,
    refusal,
)

NO_POSITION = {"line": None, "column": None}
SHORTEST_PAUSE = 0.1
"""Fewest seconds between two requests, even if the server allows less."""

LONGEST_PAUSE = 1.0
"""Seconds between two requests where the server does not ask for more."""

QUIET_SECONDS = 3.0
"""Shorter repetitions are not logged: a service that was just started is ready by then."""

log = logging.getLogger(__name__)


def refuse_closed(closed: bool) -> None:
    """Raise ClientError for a client that was closed."""
    if closed:
        raise ClientError("This client is closed. Create another, or use it within its 'with' statement.")


@contextmanager
def transport_errors(server: str, *, job_id: str | None = None) -> Iterator[None]:
    """Turn errors of the HTTP library into errors of this client."""
    try:
        yield
    except (httpx2.ConnectError, httpx2.ConnectTimeout) as error:
        if (fault := _tls_fault(error)) is not None:
            raise TLSError(_tls_message(server, fault), sent=False, job_id=job_id) from error
        raise UnreachableError(
            f"There is no server at {server} ({_reason(error)}). Start one with 'penumbra serve', or set "
            "PENUMBRA_SERVER to the address of another.",
            sent=False,
            job_id=job_id,
        ) from error
    except httpx2.TimeoutException as error:
        about = f" about job {job_id}" if job_id else ""
        raise TimedOutError(f"{server} did not answer in time{about}.", job_id=job_id) from error
    except httpx2.TransportError as error:
        message = f"The connection to {server} broke ({_reason(error)})."
        raise UnreachableError(message, job_id=job_id) from error


def _reason(error: httpx2.TransportError) -> str:
    """The reason that the system gives, without its number.

    >>> _reason(httpx2.ConnectError("[Errno 111] Connection refused"))
    'Connection refused'
    """
    return re.sub(r"^\[Errno -?\d+\] ", "", str(error))


def _tls_fault(error: BaseException) -> ssl.SSLError | None:
    """The reason why a handshake failed; None if it was none, or was cut off and may succeed next time."""
    found: BaseException | None = error
    while found is not None and not isinstance(found, ssl.SSLError):
        found = found.__cause__ or found.__context__
    return None if isinstance(found, ssl.SSLEOFError | ssl.SSLZeroReturnError) else found


def _tls_message(server: str, fault: ssl.SSLError) -> str:
    if isinstance(fault, ssl.SSLCertVerificationError):
        return (
            f"The certificate of {server} is not trusted ({fault.verify_message}). If this is the right "
            "server, set SSL_CERT_FILE to the PEM file of the authority that has signed its certificate."
        )
    return f"There is no TLS at {server} ({fault.reason}). Is it an address for http://?"


def check(answer: httpx2.Response, call: Call[Any]) -> httpx2.Response:
    """Return the answer, or raise the error that it reports."""
    if answer.is_success or (call.may_be_missing and answer.status_code == 404):
        return answer
    raise refused(answer)


def refused(answer: httpx2.Response) -> ClientError:
    """The exception for a response with a status of 300 or above, whose body has been read."""
    retry_after = _seconds(answer.headers.get("Retry-After"))
    media_type = answer.headers.get("Content-Type", "").partition(";")[0]
    if media_type != "application/problem+json":
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code} without a problem document. Is it the right one?",
            # A proxy in front of the service answers so.
            retry_after=retry_after if answer.status_code in {429, 503} else None,
        )
    try:
        document = ProblemDocument.model_validate_json(answer.content)
    except ValidationError:
        return UnexpectedAnswerError(
            f"{answer.url} answered {answer.status_code} with a broken problem document. Is it the right one?"
        )
    # The body was made here: its lines and columns mean nothing to the user.
    errors = tuple(problem.model_copy(update=NO_POSITION) for problem in document.errors)
    return refusal(
        answer.status_code, document.model_copy(update={"errors": errors}), retry_after=retry_after
    )


class Tries:
    """Whether and when a call that failed is sent again.

    A request that never left, or that the server refused for the moment, has done nothing, so any may be
    repeated then; after a broken connection only one that may be sent twice.

    Parameters
    ----------
    retry_seconds
        Seconds over which it is repeated. They are counted from the first failure on, since the server may
        hold back an answer for longer than that.
    """

    def __init__(self, call: Call[Any], retry_seconds: float) -> None:
        self._call = call
        self._retry_seconds = retry_seconds
        self._failures = 0
        self._first = 0.0
        self._logged = False

    def pause_after(self, error: ClientError) -> float:
        """Seconds to wait before the next try.

        Raises
        ------
        ClientError
            `error` itself, where there is no next try.
        """
        now = time.monotonic()
        self._first = self._first if self._failures else now
        self._failures += 1
        left = self._first + self._retry_seconds - now
        pause = self._pause(error)
        if pause is None or left <= 0:
            raise error
        if now - self._first + pause > QUIET_SECONDS and not self._logged:
            self._logged = True
            log.warning("%s Trying again for %.0f s.", error, left)
        return pause

    def _pause(self, error: ClientError) -> float | None:
        match error:
            case RefusedError(retry_after=float(seconds)) | UnexpectedAnswerError(retry_after=float(seconds)):
                asked = max(seconds, SHORTEST_PAUSE)
                return asked if self._first + self._retry_seconds >= time.monotonic() + seconds else None
            case TLSError():
                return None
            case UnreachableError(sent=sent) if self._call.repeatable or not sent:
                # At random, so that clients do not all return at the same moment.
                jitter = random.uniform(0.0, SHORTEST_PAUSE)  # noqa: S311 - no secret
                return min(LONGEST_PAUSE, SHORTEST_PAUSE * 2.0 ** (self._failures - 1) + jitter)
            case _:
                return None


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
