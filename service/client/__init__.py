"""Clients for the service, a synchronous and an asynchronous one, and their errors.

They need no part of the server, and ignore unknown fields in answers.
"""

from service.client.access import DEFAULT_SERVER
from service.client.async_client import AsyncClient
from service.client.async_jobs import AsyncRemoteJob
from service.client.client import Client
from service.client.errors import (
    BusyError,
    ClientError,
    ConflictError,
    JobCancelledError,
    JobExpiredError,
    JobFailedError,
    NoImageError,
    NotAllowedError,
    NotFoundError,
    RefusedError,
    RequestInvalidError,
    ServerFaultError,
    TimedOutError,
    TLSError,
    UnexpectedAnswerError,
    UnreachableError,
)
from service.client.following import succeeded
from service.client.jobs import RemoteJob

__all__ = [
    "DEFAULT_SERVER",
    "AsyncClient",
    "AsyncRemoteJob",
    "BusyError",
    "Client",
    "ClientError",
    "ConflictError",
    "JobCancelledError",
    "JobExpiredError",
    "JobFailedError",
    "NoImageError",
    "NotAllowedError",
    "NotFoundError",
    "RefusedError",
    "RemoteJob",
    "RequestInvalidError",
    "ServerFaultError",
    "TLSError",
    "TimedOutError",
    "UnexpectedAnswerError",
    "UnreachableError",
    "succeeded",
]
