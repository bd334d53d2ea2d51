"""The comparison as tables for a terminal, and the choice of the cheapest setting for an error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from benchmarks.peers_settings import TARGETS_255

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from benchmarks.peers_limit import Limit
    from benchmarks.peers_runs import Run

PEERS = ("Mitsuba", "POV-Ray")
OURS = "Penumbra"


def cheapest(runs: Iterable[Run], renderer: str, target_255: float) -> Run | None:
    """Find the run of a renderer that comes within an error for the fewest CPU seconds, or None.

    Examples
    --------
    >>> rough = {
    ...     "renderer": "A",
    ...     "setting": "1",
    ...     "cpu_seconds": 1.0,
    ...     "rmse_255": 2.0,
    ...     "mean_difference_255": 0.0,
    ... }
    >>> fine = {
    ...     "renderer": "A",
    ...     "setting": "2",
    ...     "cpu_seconds": 3.0,
    ...     "rmse_255": 0.5,
    ...     "mean_difference_255": 0.0,
    ... }
    >>> cheapest([fine, rough], "A", 4.0)["setting"]
    '1'
    >>> cheapest([fine, rough], "A", 1.0)["setting"]
    '2'
    >>> cheapest([fine, rough], "A", 0.1)
    """
    enough = [run for run in runs if run["renderer"] == renderer and run["rmse_255"] <= target_255]
    return min(enough, key=lambda run: run["cpu_seconds"], default=None)


def front(runs: Sequence[Run]) -> list[Run]:
    """Those of runs in order of their time that come nearer than all cheaper ones.

    Examples
    --------
    >>> run = {"renderer": "A", "setting": "", "mean_difference_255": 0.0}
    >>> runs = [run | {"cpu_seconds": s, "rmse_255": e} for s, e in ((1.0, 3.0), (2.0, 4.0), (3.0, 1.0))]
    >>> [run["rmse_255"] for run in front(runs)]
    [3.0, 1.0]
    """
    nearer: list[Run] = []
    for run in runs:
        if not nearer or run["rmse_255"] < nearer[-1]["rmse_255"]:
            nearer.append(run)
    return nearer


def target_name(target_255: float) -> str:
    """Write an error as people say it.

    Examples
    --------
    >>> [target_name(255 / 64), target_name(1.0), target_name(0.25)]
    ['1/64', '1/255', '0.25/255']
    """
    return f"1/{round(255 / target_255)}" if target_255 >= 1 else f"{target_255:g}/255"


RUN_COLUMNS = ("renderer", "setting", "CPU s", "RMSE x 255", "mean x 255")


def run_row(run: Run) -> tuple[str, ...]:
    """Cells of one setting of one renderer."""
    error, mean = f"{run['rmse_255']:.3f}", f"{run['mean_difference_255']:+.3f}"
    return run["renderer"], run["setting"], f"{run['cpu_seconds']:.2f}", error, mean


def of_runs(scene: str, runs: Iterable[Run]) -> Table:
    """Every setting of one scene."""
    table = Table(*RUN_COLUMNS, title=scene)
    for run in runs:
        table.add_row(*run_row(run))
    return table


def ratio_rows(scenes: Mapping[str, Sequence[Run]]) -> list[tuple[str, ...]]:
    """Cells of scene, error, CPU seconds of each renderer, and ours over each peer's; `-`: not reached."""
    rows = []
    for scene, runs in scenes.items():
        for target in TARGETS_255:
            found = {name: cheapest(runs, name, target) for name in (*PEERS, OURS)}
            ours = found[OURS]
            ratios = [_ratio(ours, found[peer]) for peer in PEERS]
            rows.append((scene, target_name(target), *map(_cell, found.values()), *ratios))
    return rows


RATIO_COLUMNS = ("scene", "RMSE", *PEERS, OURS, *(f"{OURS} / {peer}" for peer in PEERS))


def of_ratios(scenes: Mapping[str, Sequence[Run]]) -> Table:
    """CPU seconds at equal error."""
    table = Table(*RATIO_COLUMNS, title="CPU seconds of the cheapest setting within an error")
    for row in ratio_rows(scenes):
        table.add_row(*row)
    return table


def _cell(run: Run | None) -> str:
    return "-" if run is None else f"{run['cpu_seconds']:.2f}"


def _ratio(ours: Run | None, theirs: Run | None) -> str:
    if ours is None or theirs is None:
        return "-"
    return f"{ours['cpu_seconds'] / theirs['cpu_seconds']:.2f}"


LIMIT_COLUMNS = (
    "scene",
    "operations",
    "a sample",
    "a test",
    "calls",
    "in cache, s",
    "calls, s",
    "CPU s",
    "ratio",
)


def limit_row(limit: Limit) -> tuple[str, ...]:
    """Cells of one scene's distance from NumPy's own limit."""
    return (
        limit["scene"],
        f"{limit['operations'] / 1e6:,.0f} M",
        f"{limit['operations'] / limit['camera_samples']:,.0f}",
        f"{limit['operations'] / limit['triples']:.2f}",
        f"{limit['calls']:,}",
        f"{limit['in_cache_seconds']:.3f}",
        f"{limit['call_seconds']:.3f}",
        f"{limit['measured_seconds']:.3f}",
        f"{limit['measured_seconds'] / limit['in_cache_seconds']:.1f}",
    )


def of_limits(limits: Iterable[Limit]) -> Table:
    """How far every scene is from the time that its element operations take in cache."""
    table = Table(*LIMIT_COLUMNS, title="NumPy's own limit")
    for limit in limits:
        table.add_row(*limit_row(limit))
    return table
