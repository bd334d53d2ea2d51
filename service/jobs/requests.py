"""What a job was asked for, as it was sent."""

from __future__ import annotations

import zlib

from service.jobs import lifecycle as jobs
from service.jobs.context import Service
from service.storage.database.models import RequestRow


def request_of(service: Service, job_id: str) -> bytes:
    """Return the request of a job, byte for byte.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    """
    with service.database.reading() as session:
        return zlib.decompress(session.get_one(RequestRow, jobs.find(session, job_id).number).body)
