"""What double precision, effects and more pixels cost: runs that differ in one thing, seed by seed."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, Any

from accuracy.estimates import median

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from accuracy.study.journal import Journal
    from accuracy.study.tasks import Task

Rows = list[dict[str, Any]]


def precision(done: Sequence[Task], journal: Journal, settings: Sequence[Mapping[str, Any]]) -> Rows:
    """Settings in double precision: their seconds over those in single, and how far the pictures differ."""
    errors = {row["name"]: row["rmse_255"]["estimate"] for row in settings}
    rows = []
    for name, tasks in _by_name(done, "precision").items():
        ratios = [_spent(task, journal) / _spent(task.against, journal) for task in tasks]
        rows.append(
            {
                "name": name,
                "runs": len(tasks),
                "cpu_seconds": median([_spent(task, journal) for task in tasks]).document(),
                "ratio": median(ratios).document(),
                "difference_255": _difference_255(tasks, journal),
                "rmse_255": errors[name],
            }
        )
    return rows


def effects(done: Sequence[Task], journal: Journal) -> Rows:
    """What each effect costs: the seconds that go with it, and the pictures' difference. Dearest first."""
    whole = [_spent(task, journal) for task in done if task.part == "whole"]
    rows = []
    for name, tasks in _by_name(done, "effect").items():
        seconds = [_spent(task.against, journal) - _spent(task, journal) for task in tasks]
        rows.append(
            {
                "effect": name,
                "pointers": list(tasks[0].subject.pointers),
                "runs": len(tasks),
                "cpu_seconds": median(seconds).document(),
                "share": statistics.median(seconds) / statistics.median(whole),
                "difference_255": _difference_255(tasks, journal),
            }
        )
    return sorted(rows, key=lambda row: -row["cpu_seconds"]["estimate"])


def size(done: Sequence[Task], journal: Journal) -> dict[str, Any] | None:
    """How many times as long the scene's own size takes; None where that was not tried, or is no other."""
    own = [task for task in done if task.part == "size"]
    small = [task for task in done if task.part == "setting" and own and task.name == own[0].name]
    if not own or not small:
        return None
    large, little = (statistics.median(_spent(task, journal) for task in tasks) for tasks in (own, small))
    return {"name": own[0].name, "cpu_seconds": large, "ratio": large / little}


def _by_name(done: Sequence[Task], part: str) -> dict[str, list[Task]]:
    found: dict[str, list[Task]] = {}
    for task in done:
        if task.part == part:
            found.setdefault(task.name, []).append(task)
    return found


def _spent(task: Task | None, journal: Journal) -> float:
    assert task is not None
    return float(journal[task.key]["cpu_seconds"])


def _difference_255(tasks: Sequence[Task], journal: Journal) -> float:
    return 255 * statistics.fmean(journal[task.key]["difference"] for task in tasks)
