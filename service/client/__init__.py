"""A client for the service, and what it may raise.

It needs no part of the server and passes over what it does not know in an answer.
"""

from service.client.client import DEFAULT_SERVER, Client, succeeded
from service.client.errors import (
    BusyError,
    ClientError,
    ConflictError,
    JobCancelledError,
    JobFailedError,
    NoImageError,
    NotFoundError,
    RefusedError,
    RequestInvalidError,
    ServerFaultError,
    TimedOutError,
    UnexpectedAnswerError,
    UnreachableError,
)

__all__ = [
    "DEFAULT_SERVER",
    "BusyError",
    "Client",
    "ClientError",
    "ConflictError",
    "JobCancelledError",
    "JobFailedError",
    "NoImageError",
    "NotFoundError",
    "RefusedError",
    "RequestInvalidError",
    "ServerFaultError",
    "TimedOutError",
    "UnexpectedAnswerError",
    "UnreachableError",
    "succeeded",
]
