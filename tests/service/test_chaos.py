"""The guarantees of `make chaos`, each with few faults."""

from __future__ import annotations

import pytest

from benchmarks.chaos import jobs, processes, reads, storage

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def expected() -> list[bytes]:
    return processes.undisturbed(1)


def test_killed_workers_cost_one_retry_each(expected: list[bytes]) -> None:
    found = processes.workers_killed(3, 2, expected)
    assert found["held"], found


def test_a_server_that_is_killed_twice_loses_nothing(expected: list[bytes]) -> None:
    found = processes.server_killed(2, expected)
    assert found["held"], found


def test_a_wall_clock_that_is_set_forward_ends_no_job() -> None:
    found = jobs.clock_set((jobs.HOUR,))
    assert found["held"], found


def test_a_full_disk_makes_jobs_wait(expected: list[bytes]) -> None:
    found = storage.disk_full(expected, seconds=1.0)
    assert found["held"], found


def test_a_locked_database_makes_jobs_wait(expected: list[bytes]) -> None:
    found = storage.database_locked(expected, seconds=0.0)
    assert found["held"], found


def test_no_read_is_torn() -> None:
    found = storage.torn_reads(2_000)
    assert found["held"], found


def test_no_read_over_http_is_torn() -> None:
    found = reads.reads_over_http(300, readers=2)
    assert found["held"], found
