"""The guarantees that `make load` measures, with few jobs and without timing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.load import crowds, memory, neighbours, watchers
from benchmarks.load.promises import Promise, promise, write


def held(promises: list[Promise]) -> dict[str, bool]:
    return {one["promise"]: one["held"] for one in promises}


@pytest.mark.slow
def test_a_full_queue_says_when_to_return_and_what_is_left() -> None:
    (found,) = crowds.refusals()
    assert found["held"], found


@pytest.mark.slow
def test_one_users_many_jobs_do_not_hold_up_anothers_one() -> None:
    (found,) = neighbours.measure(many=20, visits=1)
    assert found["held"], found


@pytest.mark.slow
def test_many_watchers_by_streams_and_by_polling_get_everything() -> None:
    found, cost = watchers.measure(crowds=(1, 12))
    assert found["held"], found
    assert cost["details"]["crowds"]["12"]["events"] > 0


@pytest.mark.slow
def test_the_memory_of_every_process_is_measured_while_jobs_succeed() -> None:
    (found,) = memory.measure(jobs=40, step=40)
    (server,), (worker,) = found["details"]["mib"].values()
    assert min(server, worker) > 10


def test_the_report_has_the_machine_the_date_and_a_row_for_each_promise(tmp_path: Path) -> None:
    rows = [
        promise("It holds.", "1", held=True, limit="2", jobs=3),
        promise("Not.", "3", held=False, limit="2"),
    ]
    write(rows, tmp_path / "out" / "load.json")
    report = json.loads((tmp_path / "out" / "load.json").read_text())
    assert report["date"] == report["machine"]["date"]
    assert held(report["promises"]) == {"It holds.": True, "Not.": False}
    assert report["promises"][0]["details"] == {"jobs": 3}
