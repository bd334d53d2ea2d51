"""What each pass of a render has cost: noted while its tiles land, reported when it is finished.

Target quality notes it with the merging of a pass (``adaptive_passes.py``). With fixed quality tiles of
several passes may land in turns, so each pass has an entry of its own from the beginning.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.lifecycle import clock
from service.storage.database.models import RenderRow
from service.workers.tasks import TileDone


def begin(passes: Sequence[int]) -> list[dict[str, Any]]:
    """Give the entries of a render whose steps belong to these passes, one for each step."""
    steps = Counter(passes)
    return [
        {"left": steps[index], "seconds": 0.0, "cpu_seconds": 0.0, "rays": {}, "error": None}
        for index in sorted(steps)
    ]


def note(render: RenderRow, pass_index: int, done: TileDone) -> None:
    """Take note of a finished step of fixed quality."""
    assert render.started_at is not None
    before = render.pass_costs[pass_index]
    now = {
        "left": before["left"] - 1,
        "seconds": clock.since(render.started_at),
        "cpu_seconds": before["cpu_seconds"] + done.cpu_seconds,
        "rays": _sum(before["rays"], done.counts),
        "error": None,
    }
    render.pass_costs = [*render.pass_costs[:pass_index], now, *render.pass_costs[pass_index + 1 :]]


def note_errors(render: RenderRow, errors: Mapping[int, Mapping[str, float]]) -> None:
    """Take note of the errors of passes, known when the picture is finished."""
    render.pass_costs = [
        cost | {"error": errors.get(index)} if index in errors else cost
        for index, cost in enumerate(render.pass_costs)
    ]


def reported(render: RenderRow) -> Iterator[dict[str, Any]]:
    """Give what the render had taken when each finished pass ended, all passes before it included."""
    entries = _of_merges(render) if render.target_error is not None else _of_fixed(render)
    cpu_seconds, rays = 0.0, dict[str, int]()
    for index, (seconds, entry) in enumerate(entries):
        cpu_seconds, rays = cpu_seconds + entry["cpu_seconds"], _sum(rays, entry["rays"])
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


def _sum(so_far: Mapping[str, int], more: Mapping[str, int]) -> dict[str, int]:
    return {name: so_far.get(name, 0) + more.get(name, 0) for name in (*so_far, *more)}
