"""What simulations come to."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import numpy as np

from benchmarks.bursts import jain

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchmarks.capacity.simulation import Outcomes
    from benchmarks.capacity.workloads import Workload

FEW, MANY = 10, 100
"""Jobs of users who send few, and from which on they send many."""


class Times(TypedDict):
    """Seconds until a job's first tile begins, and until it ends: median and 99 of 100."""

    jobs: int
    first_tile: tuple[float, float]
    end: tuple[float, float]


class Figures(TypedDict):
    """One workload and what it has shown.

    Attributes
    ----------
    seconds : float
        On the simulated clock.
    busy : float
        Share of them in which the service itself decides: 1 is the most that one database can do.
    rendering : float
        Share of the slots' time in which they render.
    accept_ms, task_ms : float
        CPU milliseconds of entering a job, and of handing out and landing a task.
    tasks_each : int
        Tasks of a job: its tiles, and putting them together.
    statements : float
        Sent to the database in a simulated second.
    times : dict
        Of all jobs, and of those of users who send few and many.
    jain : float
        Fairness index of the users' speeds: of one over the mean time until their jobs end.
    """

    users: int
    jobs: int
    slots: int
    cpu_seconds: float
    load: float | None
    even: bool
    seconds: float
    busy: float
    rendering: float
    accept_ms: float
    task_ms: float
    tasks_each: int
    statements: float
    times: dict[str, Times]
    jain: float


def figures(workload: Workload, found: Outcomes) -> Figures:
    """Sum up a simulation."""
    sent = np.bincount(found.senders, minlength=workload.users)[found.senders]
    chosen = {
        "all": sent > 0,
        f"of users with at most {FEW}": sent <= FEW,
        f"of users with {MANY} and more": sent >= MANY,
    }
    return Figures(
        users=workload.users,
        jobs=workload.jobs,
        slots=workload.slots,
        cpu_seconds=workload.cpu_seconds,
        load=workload.load if np.isfinite(workload.load) else None,
        even=workload.even,
        seconds=round(found.seconds, 1),
        busy=round(sum(found.busy.values()) / found.seconds, 3),
        rendering=round(found.rendered / (workload.slots * found.seconds), 3),
        accept_ms=round(1e3 * found.busy["accepting"] / found.done["accepted"], 3),
        task_ms=round(1e3 * found.busy["rounds"] / found.done["tasks"], 3),
        tasks_each=found.done["tasks"] // found.done["accepted"],
        statements=round(found.done["statements"] / found.seconds, 1),
        times={name: _times(found, which) for name, which in chosen.items() if which.any()},
        jain=round(_fairness(found), 4),
    )


def _times(found: Outcomes, which: NDArray[np.bool_]) -> Times:
    def of(seconds: NDArray[np.float64]) -> tuple[float, float]:
        median, most = np.percentile(seconds[which], [50, 99])
        return round(float(median), 3), round(float(most), 3)

    return Times(jobs=int(which.sum()), first_tile=of(found.waits), end=of(found.totals))


def _fairness(found: Outcomes) -> float:
    counts = np.bincount(found.senders)
    sums = np.bincount(found.senders, found.totals)
    return jain((counts[counts > 0] / sums[counts > 0]).tolist())
