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
    PictureGoneError
        If the job has ended without a picture, and what it was asked for is gone with it.
    """
    with service.database.reading() as session:
        sent = session.get(RequestRow, jobs.find(session, job_id).number)
        if sent is not None:
            return zlib.decompress(sent.body)
        # Before requests were kept apart, what was rendered lay in the store as it was sent.
        render = jobs.find_render(session, job_id)
    return service.store.get_spec(render.id)
