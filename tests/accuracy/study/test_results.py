"""Results derived from the journal of a study."""

import math
from pathlib import Path
from typing import Any

import pytest

from accuracy.study import results
from accuracy.study.journal import Journal
from accuracy.study.program import Program
from accuracy.study.results import error_of
from accuracy.study.tasks import Task
from tests.accuracy.study.scenes import TINY, scene

TWO_SIDED = 1.959964  # standard deviations that hold 95 of 100 normal numbers


def run(mse: float, by_reference: float, by_pixels: float = 0.0) -> dict[str, float]:
    return {"mse": mse, "by_reference": by_reference, "by_pixels": by_pixels}


@pytest.mark.parametrize(
    ("runs", "estimate", "half"),
    [
        ([run(5.0, 9.0, 0.5)], 5.0, TWO_SIDED * 0.5),
        ([run(4.0, 9.0, 3.0), run(6.0, 9.0, 4.0)], 5.0, TWO_SIDED * 2.5),
        # 1, 2, 3: standard deviation 1, and 4.303 of Student's t with two degrees of freedom.
        ([run(value, 0.0) for value in (1.0, 2.0, 3.0)], 2.0, 4.302653 / math.sqrt(3)),
        # All are judged by one reference: more runs know no more of it.
        ([run(2.0, 0.25)] * 5, 2.0, TWO_SIDED * 0.25),
    ],
    ids=["one run", "two runs", "three runs", "one reference"],
)
def test_interval_of_an_error(runs: list[dict[str, float]], estimate: float, half: float) -> None:
    error = error_of(runs)
    assert (error.estimate, error.high) == pytest.approx((estimate, estimate + half), rel=1e-6)


SPENT = {
    "whole": 10.0,
    "light 0": 4.0,
    "highlights": 9.0,
    "antialiasing": 11.0,
    "precision": 3.0,
    "size": 8.0,
}


@pytest.fixture
def runs(tmp_path: Path) -> tuple[list[Task], Journal]:
    """All runs of a study in a journal of round figures: seeds differ by a hundredth."""
    program = Program(scene(), TINY, "here")
    tasks = program.rounds(program.references(16))
    journal = Journal(tmp_path)
    for task in tasks:
        seconds = SPENT.get(task.name, SPENT.get(task.part, 2.0)) + task.seed / 100
        journal.add({"key": task.key, "cpu_seconds": seconds, "difference": task.seed / 255})
    return tasks, journal


def test_effect_costs_the_seconds_it_adds(runs: tuple[list[Task], Journal]) -> None:
    rows = results.effects(*runs)
    found = {row["effect"]: row["cpu_seconds"]["estimate"] for row in rows}
    assert found == pytest.approx({"light 0": 6.0, "highlights": 1.0, "antialiasing": -1.0})
    assert list(found) == ["light 0", "highlights", "antialiasing"]
    assert rows[0]["share"] == pytest.approx(6 / 10.015)
    assert {row["difference_255"] for row in rows} == {1.5}


def test_precision_and_size_are_compared_seed_by_seed(runs: tuple[list[Task], Journal]) -> None:
    settings: list[dict[str, Any]] = [
        {"name": task.name, "rmse_255": {"estimate": 7.0}} for task in runs[0] if task.part == "setting"
    ]
    rows = results.precision(*runs, settings)
    assert {row["name"] for row in rows} == {"sobol 16 x 1", "uniform 4 x 4"}
    for row in rows:
        assert (row["ratio"]["low"], row["ratio"]["high"]) == pytest.approx((3.02 / 2.02, 3.01 / 2.01))
        assert (row["runs"], row["rmse_255"], row["difference_255"]) == (2, 7.0, 1.5)
    size = results.size(*runs)
    assert size is not None
    assert (size["name"], size["ratio"]) == ("sobol 4 x 1", pytest.approx(8.015 / 2.015))
