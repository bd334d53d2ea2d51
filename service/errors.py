"""Exceptions of the service; ``api/problems.py`` maps each to a response."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from schemas.errors import Problem, SceneError


class ServiceError(Exception):
    """Base of all errors of the service. The message is meant for the person who asked."""


class RequestError(ServiceError):
    """A header or a parameter of a request is malformed."""


class BodyTooLargeError(RequestError):
    """A request body is longer than the service takes."""


class BodyIncompleteError(RequestError):
    """The connection ended before the body was complete."""


class BodySlowError(RequestError):
    """A request body arrived too slowly."""


class MediaTypeError(RequestError):
    """A request body is not of a type that the route reads."""


class DisconnectedError(RequestError):
    """The client disconnected before its answer."""


class UnknownHostError(RequestError):
    """A request was sent to a name that is none of this service."""

    def __init__(self) -> None:
        super().__init__(
            "This service answers only to its own host names: those in the setting `hosts` and, if it "
            "requires no keys, 127.0.0.1 and localhost. Use one of them, or have this one added."
        )


class ParametersError(RequestError):
    """A request has query parameters that its address does not have.

    Parameters
    ----------
    problems : sequence of Problem
        One for each of them.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__(problems[0].detail)
        self.problems = problems


class PreconditionFailedError(RequestError):
    """A conditional request names another version than the current one."""

    def __init__(self) -> None:
        super().__init__(
            "The current version is not the one in If-Match or If-Unmodified-Since. Get it again."
        )


class RangeError(RequestError):
    """None of the requested bytes exist.

    Parameters
    ----------
    size : int
        Number of bytes of the resource.
    """

    def __init__(self, size: int) -> None:
        super().__init__(f"There are only {size} bytes.")
        self.size = size


class UnauthenticatedError(ServiceError):
    """A key is needed.

    Parameters
    ----------
    wrong : bool
        Whether a key was sent, and is not valid.
    """

    def __init__(self, *, wrong: bool) -> None:
        found = (
            "This key is not valid: it may have been revoked." if wrong else "This service requires a key."
        )
        super().__init__(
            f"{found} Send yours as 'Authorization: Bearer pnm_...'; ask the service's operator for one."
        )


class KeyExpiredError(ServiceError):
    """A key was valid once.

    Parameters
    ----------
    expired_at : datetime
        Its end, in UTC.
    """

    def __init__(self, expired_at: datetime) -> None:
        super().__init__(
            f"This key expired on {expired_at:%Y-%m-%d at %H:%M} UTC. Ask the service's operator for another."
        )


class UnknownKeyError(ServiceError):
    """No key has this id."""

    def __init__(self) -> None:
        super().__init__("There is no key with this id.")


class ForbiddenError(ServiceError):
    """A user may not do this."""


class CrossSiteError(ForbiddenError):
    """A browser sent a changing request for a page of another site."""

    def __init__(self) -> None:
        super().__init__(
            "A page of another site sent this request. Send it from this service's own page, or with a key."
        )


class UnknownJobError(ServiceError):
    """No job has this id."""

    def __init__(self) -> None:
        super().__init__("There is no job with this id. It may have been deleted.")


class DamagedJobError(ServiceError):
    """The record of a job in the database cannot be read."""

    def __init__(self) -> None:
        super().__init__(
            "The record of this job in the database is damaged. Submit its scene again, or restore a backup."
        )


class ReusedKeyError(ServiceError):
    """An ``Idempotency-Key`` was used for another request before.

    Parameters
    ----------
    key : str
        The key.
    """

    def __init__(self, key: str) -> None:
        super().__init__(
            f"The Idempotency-Key {key!r} was used for another request. Give each request a key of its own."
        )


class PictureNotReadyError(ServiceError):
    """A job has no picture yet."""


class PictureGoneError(ServiceError):
    """A job ended without a picture."""


class PictureDamagedError(PictureGoneError):
    """A file of a finished picture is damaged."""

    def __init__(self, name: str) -> None:
        super().__init__(damaged(name))


def damaged(name: str) -> str:
    """Say that a file of a finished picture is damaged, and what to do."""
    return f"The stored {name} of this picture is damaged. Submit the job again for a new one."


class UnknownLayerError(ServiceError):
    """The job was not rendered with this layer."""


class UnknownAssetError(ServiceError):
    """No asset was uploaded under this name."""

    def __init__(self) -> None:
        super().__init__("You have uploaded no asset under this name.")


class UploadError(ServiceError):
    """An uploaded asset was refused."""


class UploadMismatchError(UploadError):
    """The bytes sent do not have the hash in the address."""


class UploadQuotaError(UploadError):
    """A user's assets would exceed the quota.

    Parameters
    ----------
    limit : int
        The quota, bytes.
    left : int
        Bytes that remain.
    """

    def __init__(self, limit: int, left: int) -> None:
        super().__init__(
            f"Your asset quota is {limit} bytes; {left} remain. "
            "Send a smaller file, or ask staff for a larger quota."
        )


class UploadUnusableError(UploadError):
    """The bytes sent are not a picture that the renderer can use."""


class DatabaseUrlError(ServiceError):
    """The address of the database cannot be used."""


class DatabaseVersionError(ServiceError):
    """Another version of the service has made the tables of the database."""


class EngineError(ServiceError):
    """The configured engine is not available."""


class EngineMissingError(EngineError):
    """The packages of an engine are not installed."""

    def __init__(self) -> None:
        super().__init__(
            "This engine needs the packages distributed and cryptography. Install them with: "
            "pip install 'penumbra-render[dask]'"
        )


class UnsafeClusterError(EngineError):
    """Anyone on the network could run code on a cluster."""


class UnusableWorkerError(EngineError):
    """A worker of a cluster cannot render; the message says what it lacks."""


class StoreError(ServiceError):
    """Base of the errors of the store, a folder or a bucket."""


class StoreFullError(StoreError):
    """The disk is full."""


class StoreReadOnlyError(StoreError):
    """The data folder cannot be written now."""


class StoreAwayError(StoreError):
    """The store cannot be reached now."""


class StoreMissingError(StoreError):
    """The packages for a bucket are not installed."""

    def __init__(self) -> None:
        super().__init__(
            "A bucket needs the package obstore. Install it with: pip install 'penumbra-render[s3]'"
        )


class StoreDamagedError(StoreError):
    """A stored file is missing or damaged.

    Attributes
    ----------
    name : str
        Its name in the store.
    """

    def __init__(self, name: str) -> None:
        super().__init__(f"The stored file {name} is damaged.")
        self.name = name

    def __reduce__(self) -> tuple[type[StoreDamagedError], tuple[str]]:
        """Support pickling, to travel between processes."""
        return StoreDamagedError, (self.name,)


class RequestDamagedError(StoreError):
    """The stored request of a job is missing or damaged."""

    def __init__(self) -> None:
        super().__init__("The stored request of this job is damaged. Submit the job again.")


class StoreTakenError(StoreError):
    """Another service uses the same data folder or bucket."""


class RefusedError(SceneError):
    """A worker has refused the request of a call; pointers lead into the request."""


class PlanFailedError(ServiceError):
    """A scene could not be planned."""


class TraceFailedError(ServiceError):
    """Rays could not be traced."""


class QuoteFailedError(ServiceError):
    """A scene could not be quoted."""


class PreviewFailedError(ServiceError):
    """A preview could not be rendered."""


class ComparisonFailedError(ServiceError):
    """Two pictures could not be compared."""


class InspectionFailedError(ServiceError):
    """The pixel of an inspection could not be rendered."""


class UnavailableError(ServiceError):
    """The service cannot do this now and may be able to do it later."""


class BusyError(UnavailableError):
    """Too many requests of one kind are in progress."""


class QueueFullError(UnavailableError):
    """A job does not fit into the queue now.

    Parameters
    ----------
    headers : dict
        ``Retry-After``, and how full the queue is.
    """

    def __init__(self, message: str, headers: dict[str, str]) -> None:
        super().__init__(message)
        self.headers = headers


class WorkerLostError(UnavailableError):
    """A worker process died during a call."""
