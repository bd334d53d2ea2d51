"""Exceptions of the clients.

ClientError
├── UnreachableError           no connection, or it broke before the answer was complete
│   └── TLSError               the server's certificate is not trusted, or it speaks no TLS
├── TimedOutError              no answer, or no end of the job, in time; `job_id` says which job
├── UnexpectedAnswerError      the answer is not one of this service
├── RefusedError               the service answered with a problem document
│   ├── RequestInvalidError    the request, or the scene in it, is not usable
│   ├── NotAllowedError        the service needs a key, or another one
│   ├── NotFoundError          no such job, asset or image
│   ├── ConflictError          the state of the job does not allow it
│   ├── BusyError              too much work at the moment: try again later
│   └── ServerFaultError       the service itself failed
└── NoImageError               the job ended without the requested image
    ├── JobFailedError         `failure` says why, and whether it is worth another try
    ├── JobCancelledError      it was cancelled
    └── JobExpiredError        it was kept as long as the service keeps jobs
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from schemas.api.jobs import Failure
from schemas.errors import Problem, ProblemDocument


class ClientError(Exception):
    """Base of all errors of :class:`service.client.Client`."""

    def __reduce__(self) -> tuple[Any, ...]:
        # By default only the message would be passed to constructors that take other arguments.
        return _unpickled, (type(self), self.args, self.__dict__)


def _unpickled(kind: type[ClientError], args: tuple[Any, ...], state: dict[str, Any]) -> ClientError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


class UnreachableError(ClientError):
    """There is no connection to the server, or it broke before the answer was complete.

    `sent` is False if the request cannot have reached the server. `job_id` is the job that it was about.
    """

    def __init__(self, message: str, *, sent: bool = True, job_id: str | None = None) -> None:
        super().__init__(message)
        self.sent = sent
        self.job_id = job_id


class TLSError(UnreachableError):
    """The server's certificate is not trusted, or it speaks no TLS: another try would end in the same way."""


class TimedOutError(ClientError):
    """Something took longer than allowed; the job, if there is one, keeps running.

    `what` says so in one sentence, `job_id` names the job; the message also says how to wait again.
    """

    def __init__(self, what: str, *, job_id: str | None = None) -> None:
        super().__init__(f"{what} {what_next(job_id)}" if job_id else what)
        self.what = what
        self.job_id = job_id


class UnexpectedAnswerError(ClientError):
    """The answer is not one that this client knows.

    `retry_after` has the seconds that a proxy in front of the service asks to wait, None if it does not.
    """

    def __init__(self, message: str, *, retry_after: float | None = None) -> None:
        super().__init__(message)
        self.retry_after = retry_after


class RefusedError(ClientError):
    """The service answered with a problem document.

    Attributes
    ----------
    status
        HTTP status code.
    document
        The whole problem document.
    retry_after
        Seconds after which another try makes sense, where the service said so.
    """

    def __init__(self, status: int, document: ProblemDocument, *, retry_after: float | None = None) -> None:
        self.status = status
        self.document = document
        self.retry_after = retry_after
        lines = described(document.errors, document.more)
        super().__init__("\n".join([REFUSED, *lines]) if lines else _headline(document))

    @property
    def errors(self) -> Sequence[Problem]:
        """All problems, each with its pointer into the request body."""
        return self.document.errors


class RequestInvalidError(RefusedError):
    """The request, or the scene in it, is not usable."""


class NotAllowedError(RefusedError):
    """The service needs a key, or another one: give it as ``Client(key=...)`` or in ``PENUMBRA_KEY``."""


class NotFoundError(RefusedError):
    """There is no such job, asset or image."""


class ConflictError(RefusedError):
    """The state of the job does not allow the request."""


class BusyError(RefusedError):
    """The service has too much work at the moment."""


class ServerFaultError(RefusedError):
    """The service itself failed."""


class NoImageError(ClientError):
    """The job ended without the requested image."""

    def __init__(self, message: str, *, job_id: str) -> None:
        super().__init__(message)
        self.job_id = job_id


class JobFailedError(NoImageError):
    """The job failed; `failure` says why."""

    def __init__(self, *, job_id: str, failure: Failure) -> None:
        super().__init__(f"Job {job_id} failed ({failure.code}): {failure.message}", job_id=job_id)
        self.failure = failure


class JobCancelledError(NoImageError):
    """The job was cancelled."""

    def __init__(self, *, job_id: str) -> None:
        super().__init__(f"Job {job_id} was cancelled.", job_id=job_id)


class JobExpiredError(NoImageError):
    """The job ended longer ago than the service keeps jobs."""

    def __init__(self, *, job_id: str) -> None:
        super().__init__(
            f"Job {job_id} has expired, and its picture has been deleted. Submit it again.", job_id=job_id
        )


def what_next(job_id: str) -> str:
    """Suggest what to do with a job after the wait has ended."""
    return f"Wait again with client.wait({job_id!r}), or stop it with client.cancel({job_id!r})."


def refusal(status: int, document: ProblemDocument, *, retry_after: float | None = None) -> RefusedError:
    """The exception for a problem document with this status."""
    kind = _BY_STATUS.get(status, ServerFaultError if status >= 500 else RequestInvalidError)
    return kind(status, document, retry_after=retry_after)


def described(problems: Sequence[Problem], more: int = 0) -> list[str]:
    """One line for each problem: pointer, line and column where known, what is wrong, what to do."""
    lines = [_described(problem) for problem in problems]
    return [*lines, f"... and {more} more"] if more else lines


REFUSED = "The service refused the request:"
"""First line of the message, above one line for each problem."""

_BY_STATUS: dict[int, type[RefusedError]] = {
    401: NotAllowedError,
    403: NotAllowedError,
    404: NotFoundError,
    409: ConflictError,
    410: NotFoundError,
    429: BusyError,
    503: BusyError,
    507: BusyError,
}


def _headline(document: ProblemDocument) -> str:
    return f"{document.title}: {document.detail}" if document.detail else document.title


def _described(problem: Problem) -> str:
    place = problem.pointer or "(whole document)"
    if problem.line is not None:
        place += f" (line {problem.line}, column {problem.column})"
    advice = f" Did you mean {problem.suggestion!r}?" if problem.suggestion else ""
    return f"{place}: {problem.detail}{advice}"
