"""Limits on the jobs and CPU seconds of each user and of all in the queue."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Row, bindparam, case, func, select

import renderer
from schemas.errors import Problem
from service.access.principals import Principal
from service.errors import QueueFullError
from service.settings import Settings
from service.storage.database.models import JobRow

_MINE = JobRow.owner == bindparam("owner")
COUNTED = select(
    func.count().label("jobs"),
    func.coalesce(func.sum(JobRow.load), 0.0).label("cpu_seconds"),
    func.coalesce(func.sum(case((_MINE, 1), else_=0)), 0).label("my_jobs"),
    func.coalesce(func.sum(case((_MINE, JobRow.load), else_=0.0)), 0.0).label("my_cpu_seconds"),
).where(JobRow.finished_at.is_(None))
"""The jobs of all users in the queue, and those of ``owner``, with their CPU seconds."""
# The longest Retry-After, seconds: by then other jobs may be cancelled.
LONGEST_WAIT = 3600.0


@dataclass(frozen=True)
class Share:
    """Use of a limit, by one user or by all."""

    name: str
    limit: float
    taken: float

    @property
    def left(self) -> float:
        """Remaining amount."""
        return max(0.0, self.limit - self.taken)


@dataclass(frozen=True)
class Queue:
    """Length of a user's queue, and CPU seconds of it that are rendered in a second."""

    jobs: Share
    cpu_seconds: Share
    rate: float

    def headers(self) -> dict[str, str]:
        """The queue as the headers of the IETF's draft on RateLimit."""
        shares = (self.jobs, "requests"), (self.cpu_seconds, "cpu-seconds")
        policy = ", ".join(f'"{share.name}";q={share.limit:.0f};qu="{unit}"' for share, unit in shares)
        left = ", ".join(f'"{share.name}";r={math.floor(share.left)}' for share, _ in shares)
        return {"RateLimit-Policy": policy, "RateLimit": left}


def check_queue(
    counted: Row[Any], settings: Settings, principal: Principal, job: JobRow, rate: float
) -> Queue:
    """Check that a job fits into the queue; one that is answered from the store always does.

    Parameters
    ----------
    counted
        The row that `COUNTED` selected.
    rate
        CPU seconds that are rendered in a second.

    Raises
    ------
    QueueFullError
        Says when to try again.
    renderer.SceneError
        If it would not fit into an empty queue either.
    """
    my_most = principal.max_jobs or settings.max_user_jobs
    # Keys of an earlier version may have infinite limits, which that of all jobs bounds.
    mine = principal.max_cpu_seconds or settings.max_user_cpu_seconds
    my_most_seconds = min(settings.max_queued_cpu_seconds, mine)
    adds = 0 if job.state.final else 1
    shares = (
        Share("jobs", my_most, counted.my_jobs + adds),
        Share("cpu", my_most_seconds, counted.my_cpu_seconds + job.load),
        Share("all jobs", settings.max_queued_jobs, counted.jobs + adds),
        Share("all cpu", settings.max_queued_cpu_seconds, counted.cpu_seconds + job.load),
    )
    if job.load > my_most_seconds:
        _refuse_expensive(job.load, my_most_seconds)
    queue = Queue(shares[0], shares[1], rate)
    if adds:
        _refuse(queue, shares, job.predicted_cpu_seconds)
    return queue


def _refuse_expensive(cost: float, limit: float) -> None:
    """Refuse a job that would not fit into an empty queue."""
    detail = (
        f"This is predicted to take {cost:.3g} CPU seconds, more than the {limit:.3g} allowed for your jobs. "
        "Ask for fewer pixels, samples or light samples."
    )
    raise renderer.SceneError([Problem(pointer="/scene", detail=detail, code="cost")])


def _refuse(queue: Queue, shares: tuple[Share, ...], cost: float) -> None:
    full = [share for share in shares if share.taken > share.limit]
    if not full:
        return
    # There is room when work of about this cost has been rendered.
    excess = max(share.taken - share.limit if "cpu" in share.name else cost for share in full)
    wait = min(LONGEST_WAIT, max(1.0, excess / queue.rate))
    whose = "Your queue" if full[0].name in ("jobs", "cpu") else "The queue"
    amount = "CPU seconds" if "cpu" in full[0].name else "jobs"
    raise QueueFullError(
        f"{whose} is full: at most {full[0].limit:.0f} {amount}. Try again in {math.ceil(wait)} seconds.",
        {"Retry-After": str(math.ceil(wait))} | queue.headers(),
    )
