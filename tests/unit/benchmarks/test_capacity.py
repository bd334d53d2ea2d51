from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.capacity.figures import figures
from benchmarks.capacity.simulation import COMPOSING, Outcomes, Simulation
from benchmarks.capacity.workloads import Workload

ALL_AT_ONCE = float("inf")


def simulated(workload: Workload, folder: Path) -> Outcomes:
    return Simulation(workload, folder).run()


@pytest.fixture(scope="module")
def crowd(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workload, Outcomes]:
    """Six users who send five jobs each at the same time, for three slots."""
    workload = Workload(users=6, jobs=30, slots=3, cpu_seconds=20.0, load=ALL_AT_ONCE, even=True)
    return workload, simulated(workload, tmp_path_factory.mktemp("crowd"))


def test_every_job_is_rendered_to_its_end(crowd: tuple[Workload, Outcomes]) -> None:
    workload, found = crowd
    assert found.done["accepted"] == workload.jobs
    assert np.all(found.totals >= found.waits)
    assert np.all(found.waits > 0.0)


def test_slots_render_no_more_than_there_is_time(crowd: tuple[Workload, Outcomes]) -> None:
    workload, found = crowd
    assert found.rendered <= workload.slots * found.seconds
    # Three slots have something to do until the last of thirty jobs; its four tiles come one after another.
    assert found.rendered >= workload.slots * (found.seconds - 3 * workload.cpu_seconds)


def test_equal_requests_get_equal_shares(crowd: tuple[Workload, Outcomes]) -> None:
    assert figures(*crowd)["jain"] > 0.95


def test_where_there_is_room_a_job_takes_what_its_tiles_take(tmp_path: Path) -> None:
    workload = Workload(users=1, jobs=1, slots=1, cpu_seconds=50.0, load=0.1)
    found = simulated(workload, tmp_path)
    decided = sum(found.busy.values())
    assert found.rendered < found.totals[0] <= found.rendered + decided
    assert found.done["tasks"] == figures(workload, found)["tasks_each"]
    assert found.rendered > COMPOSING


@pytest.mark.slow
def test_users_with_few_jobs_do_not_wait_for_users_with_many(tmp_path: Path) -> None:
    workload = Workload(users=40, jobs=120, slots=2, cpu_seconds=40.0, load=20.0)
    found = simulated(workload, tmp_path)
    sent = np.bincount(found.senders, minlength=workload.users)[found.senders]
    assert np.median(found.totals[sent <= 2]) < np.median(found.totals[sent >= 20])


def test_a_tile_takes_in_the_mean_what_it_is_expected_to() -> None:
    factors = Workload(users=1, jobs=1, slots=1, cpu_seconds=1.0, load=1.0).factors()
    # Five standard deviations of a mean of 1,024 with exp(0.25) - 1 = 0.284 as variance.
    assert abs(factors.mean() - 1.0) < 5.0 * np.sqrt(np.expm1(0.25) / len(factors))
