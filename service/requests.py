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
    PictureGoneError
        If the job has ended without a picture, and what it was asked for is gone with it.
    """
    with service.database.reading() as session:
        render = jobs.find_render(session, job_id)
    return service.store.get_spec(render.id)
