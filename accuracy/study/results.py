"""The results of a study as one document, `results.json`."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING, Any

from accuracy.statistics import clipped, half_width, median
from accuracy.study import curves
from accuracy.study.reference import Reference
from accuracy.study.settings import METHODS, REFERENCE_PATTERN, Setting
from renderer.math.intervals import INTERVAL_DEVIATIONS, Interval

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from accuracy.study.journal import Journal, Machine
    from accuracy.study.program import Program
    from accuracy.study.tasks import Task


FORMAT = 1
"""Version of the document, raised when a member changes its meaning."""

MIN_RUNS = 3
"""Runs needed for an interval from their variance. With two, Student's t of 12.7 makes it useless."""

SAME_TIME_RATIO = 1.2
"""Ratio of times that count as equal, since settings have discrete costs."""

FILTERED_NOTE = (
    "A texture of this scene is filtered by the number of samples: with few samples it is blurred, and that "
    "counts as error here."
)

LEVELS_255 = (16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25)
"""Errors at which methods are compared, in units of 1/255."""

Rows = list[dict[str, Any]]


def document(
    program: Program,
    references: tuple[Task, Task],
    tasks: Sequence[Task],
    journal: Journal,
    machine: Machine,
) -> dict[str, Any]:
    """Collect the results of a study from its journal."""
    done = [task for task in tasks if task.key in journal]
    first, second = (clipped(journal.picture(task.key)) for task in references)
    reference = Reference(first, second)
    rows = _rows(program.settings, done, journal)
    best = {row["name"] for row in curves.front(rows)}
    rows = [row | {"front": row["name"] in best} for row in rows]
    camera, own = program.subject.scene.document.camera, program.scene.document.camera
    return {
        "format": FORMAT,
        "scene": program.scene.document.name or "",
        "width": camera.picture_size[0],
        "height": camera.picture_size[1],
        "own_width": own.picture_size[0],
        "own_height": own.picture_size[1],
        "area_lights": program.area_lights,
        "machine": machine,
        "runs": {"planned": len(tasks) + len(references), "done": len(done) + len(references)},
        "reference": {
            "setting": (
                f"two halves of {Setting(REFERENCE_PATTERN, references[0].quality).name} with different seeds"
            ),
            "rmse_255": 255 * math.sqrt(reference.own_mse),
            "cpu_seconds": sum(journal[task.key]["cpu_seconds"] for task in references),
        },
        "settings": rows,
        "methods": _methods(rows),
        "equal_error": _equal_error(rows),
        "precision": precision(done, journal, rows),
        "effects": effects(done, journal),
        "size": size(done, journal),
        "notes": _notes(program),
    }


def error_of(runs: Sequence[Mapping[str, Any]]) -> Interval:
    """The mean squared error of the runs of a setting.

    Its interval includes the variance over seeds and that of the reference. The former is estimated from
    three or more runs, or else bounded from the pixels of each.
    """
    values = [run["mse"] for run in runs]
    middle = statistics.fmean(values)
    if len(runs) < MIN_RUNS:
        half = INTERVAL_DEVIATIONS * math.sqrt(sum(run["by_pixels"] ** 2 for run in runs)) / len(runs)
    else:
        half = math.hypot(half_width(values), INTERVAL_DEVIATIONS * runs[0]["by_reference"])
    return Interval(middle, middle - half, middle + half)


def root_255(squares: Interval) -> Interval:
    """Convert a mean squared error to a root mean square error in units of 1/255; negative ones count as 0.

    Examples
    --------
    >>> root_255(Interval(4 / 255**2, -1.0, 9 / 255**2))
    Interval(estimate=2.0, low=0.0, high=3.0)
    """
    return Interval(
        *(255 * math.sqrt(max(end, 0.0)) for end in (squares.estimate, squares.low, squares.high))
    )


def at_equal_time(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The best setting of each method at a common time."""
    groups = [curves.front([row for row in document["settings"] if row["method"] == m]) for m in METHODS]
    groups = [group for group in groups if group]
    if not groups:
        return []
    times = [curves.seconds(row) for group in groups for row in group]
    best = min(times, key=lambda spent: max(min(_apart(row, spent) for row in group) for group in groups))
    chosen = (_best_within(group, best) for group in groups)
    return [{key: row[key] for key in ("name", "method", "cpu_seconds", "rmse_255", "hot")} for row in chosen]


def _best_within(group: Sequence[curves.Row], spent: float) -> curves.Row:
    """The best setting within about so many seconds, or else the nearest one."""
    enough = [row for row in group if curves.seconds(row) <= SAME_TIME_RATIO * spent]
    return enough[-1] if enough else min(group, key=lambda row: _apart(row, spent))


def _apart(row: curves.Row, spent: float) -> float:
    return abs(math.log(curves.seconds(row) / spent))


def _rows(settings: Iterable[Setting], done: Sequence[Task], journal: Journal) -> list[dict[str, Any]]:
    found: dict[str, list[Any]] = {}
    for task in done:
        if task.part == "setting":
            found.setdefault(task.name, []).append(journal[task.key])
    return [_row(setting, found[setting.name]) for setting in settings if setting.name in found]


def _row(setting: Setting, runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    judged = [run["judgement"] for run in runs]
    rmse = root_255(error_of(judged))
    return {
        "name": setting.name,
        "method": setting.method,
        "counts": setting.counts,
        "camera_samples": setting.samples or None,
        "light_points": setting.points or None,
        "runs": len(runs),
        "cpu_seconds": median([run["cpu_seconds"] for run in runs]).document(),
        "prepare_seconds": statistics.median(run["prepare_seconds"] for run in runs),
        "rays": statistics.fmean(sum(run["rays"].values()) for run in runs),
        "rmse_255": rmse.document(),
        "resolved": rmse.low > 0,
        "edges_rmse_255": _mean_255(judged, "edges_mse"),
        "smooth_rmse_255": _mean_255(judged, "smooth_mse"),
        "hot": statistics.fmean(run["hot"] for run in judged),
    }


def _mean_255(judged: Sequence[Mapping[str, Any]], name: str) -> float:
    return 255 * math.sqrt(max(0.0, statistics.fmean(run[name] for run in judged)))


def _methods(rows: Sequence[curves.Row]) -> list[dict[str, Any]]:
    found = []
    for method in METHODS:
        own = [row for row in rows if row["method"] == method]
        best, fewest = curves.front(own), curves.front(own, curves.rays)
        power, by_rays = curves.order(best), curves.order(fewest, curves.rays)
        more = curves.halving(power) if power else None
        if own:
            found.append(
                {
                    "method": method,
                    "front": [row["name"] for row in best],
                    "front_by_rays": [row["name"] for row in fewest],
                    "order": power.document() if power else None,
                    "order_by_rays": by_rays.document() if by_rays else None,
                    "halving": more.document() if more else None,
                }
            )
    return found


def _equal_error(rows: Sequence[curves.Row]) -> list[dict[str, Any]]:
    """CPU seconds of each method at errors that two or more methods reach."""
    lines = {method: curves.front([row for row in rows if row["method"] == method]) for method in METHODS}
    found = []
    for level in LEVELS_255:
        costs = {method: curves.cost_at(line, level) for method, line in lines.items()}
        reached = {method: cost for method, cost in costs.items() if cost is not None}
        if len(reached) > 1:
            least = min(reached.values())
            ratios = {method: cost / least for method, cost in reached.items()}
            found.append({"rmse_255": level, "cpu_seconds": reached, "ratios": ratios})
    return found


def _notes(program: Program) -> list[str]:
    textures = program.scene.document.textures.values()
    if any(getattr(texture, "filter", None) in {"mipmap", "box"} for texture in textures):
        return [FILTERED_NOTE]
    return []


def precision(done: Sequence[Task], journal: Journal, settings: Sequence[Mapping[str, Any]]) -> Rows:
    """Settings in double precision: ratio of seconds to single precision, and difference of the pictures."""
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
    """The cost of each effect, most expensive first: the seconds that it adds, and what it changes."""
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
    """The cost of the scene's own size over that of the study's; None if it was not tried, or is the same."""
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
