"""What a job was asked for, as it was sent."""

from __future__ import annotations

from service import jobs
from service.context import Service


def request_of(service: Service, job_id: str) -> bytes:
    """Return the request of a job, byte for byte.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    """
    with service.database.reading() as session:
        row = jobs.find(session, job_id)
    return service.store.get_spec(row.id)
