"""The parts of the service that a simulation runs, and what stands in for the others."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import TYPE_CHECKING

from benchmarks.capacity.workloads import request
from renderer import tiling
from service.access.principals import LOCAL
from service.app import assemble
from service.dispatch.job_events import JobEvents
from service.jobs.admission import Admitted, admit
from service.lifecycle import rows
from service.settings import Settings
from service.storage.folder import Folder
from service.storage.tiles import TileStore

if TYPE_CHECKING:
    from pathlib import Path

    from service.jobs.context import Service


MANY = 10**9


class Nowhere(TileStore):
    """Forgets what jobs ask for: in a simulation nobody renders it."""

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep nothing."""

    def drop_job(self, job: str) -> None:
        """Forget nothing."""


def service(folder: Path, url: str | None) -> Service:
    """Make the parts of a service, with a database in a folder or at a URL, whose dispatcher does not run."""
    settings = Settings(
        data=folder,
        database=url,
        max_queued_jobs=MANY,
        max_queued_cpu_seconds=MANY,
        max_user_jobs=MANY,
        max_user_cpu_seconds=MANY,
        log_level="error",
    )
    return asyncio.run(_assembled(settings))


async def _assembled(settings: Settings) -> Service:
    # Job events need the loop that its readers run on; here nobody reads.
    return assemble(settings, JobEvents(), Nowhere(Folder(settings.data / "jobs")))


def admitted(here: Service, cpu_seconds: float) -> Admitted:
    """Admit the job that everybody sends, at a price of this many CPU seconds."""
    found = admit(here, LOCAL, request())
    cost = found.description.cost.model_copy(update={"cpu_seconds": cpu_seconds})
    return replace(found, description=found.description.model_copy(update={"cost": cost}))


def work(job: Admitted) -> int:
    """Count the camera samples of a job, those of its coarse picture too."""
    plan = job.plan
    return sum(rows.work(pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, None))
