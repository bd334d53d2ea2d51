"""Having a part of a picture first. It changes when tiles are rendered, and nothing in them."""

from __future__ import annotations

from schemas.reading import read_document
from schemas.regions import Region
from service.jobs import lifecycle as jobs
from service.jobs.context import Service


def focus(service: Service, job_id: str, body: bytes) -> None:
    """Have the tiles of a region rendered before the others of their pass; what has ended stays as it is.

    Jobs that share what is rendered share its order, too: the last request counts.

    Raises
    ------
    UnknownJobError
        If there is no such job.
    PictureGoneError
        If the job has ended without a picture.
    renderer.SceneError
        If the region has no pixels.
    """
    with service.database.reading() as session:
        jobs.find_render(session, job_id)
    region, _ = read_document(body, Region, limits=service.settings.limits)
    with service.database.writing() as session:
        render = jobs.find_render(session, job_id)
        if not render.state.final:
            render.focus = region.model_dump()
