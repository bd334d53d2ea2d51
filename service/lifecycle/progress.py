"""Progress of a render: its share, the remaining time, and the cost of each pass.

With target quality the merging of a pass (``adaptive_passes.py``) notes its cost. With fixed quality tiles of
several passes may land in turns, so each pass has an entry of its own from the beginning.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any

from renderer.adaptive.forecast import MAX_PROGRESS, Forecast, limited, share_by
from schemas.api.jobs import JobState
from service.lifecycle import clock, rows
from service.storage.database.models import RenderRow
from service.workers.tasks import TileDone


def share(render: RenderRow) -> float:
    """Return the finished share of a render, 0 to 1; it is 1 only once the picture exists.

    With target quality, an expired time limit completes it, too.
    """
    done = rows.share(render)
    if render.state == JobState.SUCCEEDED:
        return done
    if render.target_error is None or render.state != JobState.RUNNING or render.started_at is None:
        return min(done, MAX_PROGRESS)
    return share_by(done, rows.ran_for(render), render.time_limit or inf)


def remaining_seconds(render: RenderRow) -> float | None:
    """Predict in how many seconds a render will be finished; None if it does not run or nothing is known."""
    if render.state != JobState.RUNNING or render.started_at is None or render.paused_at is not None:
        return None
    elapsed = rows.ran_for(render)
    return limited(_work_seconds(render, elapsed), elapsed, render.time_limit or inf)


def _work_seconds(render: RenderRow, elapsed: float) -> float:
    """Predict how long the rest of the work takes after ``elapsed`` seconds; inf if nothing is known."""
    if render.target_error is None:
        done = share(render)
        return elapsed / done - elapsed if done else inf
    newest = render.merges[-1] if render.merges else {}
    # Passes that version 0.1 has merged say nothing.
    if not newest.get("expected"):
        return inf
    part = (render.done_work - render.counted_work) / newest["samples"]
    return Forecast(**newest["expected"]).seconds_left(render.cpu_seconds, part, elapsed)


def begin_passes(passes: Sequence[int]) -> list[dict[str, Any]]:
    """Make the entries of a render of fixed quality whose steps belong to these passes, one for each step."""
    steps = Counter(passes)
    return [
        {"left": steps[index], "seconds": 0.0, "cpu_seconds": 0.0, "rays": {}, "error": None}
        for index in sorted(steps)
    ]


def note_step(render: RenderRow, pass_index: int, done: TileDone) -> None:
    """Record a finished step of fixed quality."""
    assert render.started_at is not None
    if pass_index >= len(render.pass_costs):
        # A render older than these entries: its passes are not reported.
        return
    before = render.pass_costs[pass_index]
    now = {
        "left": before["left"] - 1,
        "seconds": clock.since(render.started_at),
        "cpu_seconds": before["cpu_seconds"] + done.cpu_seconds,
        "rays": add_counts(before["rays"], done.counts),
        "error": None,
    }
    render.pass_costs = [*render.pass_costs[:pass_index], now, *render.pass_costs[pass_index + 1 :]]


def take_back_step(render: RenderRow, pass_index: int) -> None:
    """Record that a finished step of fixed quality is rendered again; what it has cost stays."""
    if pass_index < len(render.pass_costs):
        costs = [dict(cost) for cost in render.pass_costs]
        costs[pass_index]["left"] += 1
        render.pass_costs = costs


def note_errors(render: RenderRow, errors: Mapping[int, Mapping[str, float]]) -> None:
    """Record the errors of passes, known when the picture is finished."""
    render.pass_costs = [
        cost | {"error": errors.get(index)} if index in errors else cost
        for index, cost in enumerate(render.pass_costs)
    ]


def finished_passes(render: RenderRow) -> Iterator[dict[str, Any]]:
    """Return the cumulative cost of a render at the end of each finished pass."""
    entries = _of_merges(render) if render.target_error is not None else _of_fixed(render)
    cpu_seconds, rays = 0.0, dict[str, int]()
    for index, (seconds, entry) in enumerate(entries):
        cpu_seconds, rays = cpu_seconds + entry["cpu_seconds"], add_counts(rays, entry["rays"])
        yield {
            "pass_index": index,
            "seconds": seconds,
            "cpu_seconds": cpu_seconds,
            "rays": rays,
            "error": entry["error"],
        }


def _of_merges(render: RenderRow) -> Iterator[tuple[float, dict[str, Any]]]:
    seconds = 0.0
    for entry in render.merges:
        seconds += entry["seconds"]
        yield seconds, entry


def _of_fixed(render: RenderRow) -> Iterator[tuple[float, dict[str, Any]]]:
    seconds = 0.0
    for entry in render.pass_costs:
        if entry["left"]:
            return
        seconds = max(seconds, entry["seconds"])
        yield seconds, entry


def add_counts(so_far: Mapping[str, int], more: Mapping[str, int]) -> dict[str, int]:
    """Add counts by name; a name with count 0 stays in."""
    return {name: so_far.get(name, 0) + more.get(name, 0) for name in (*so_far, *more)}
