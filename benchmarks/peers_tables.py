"""The comparison as rows of cells: for tables on a terminal and for those of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from benchmarks.peers_runs import OURS, OURS_FIXED, PEER, POV

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from benchmarks.peers_comparison import Comparison, Precision
    from benchmarks.peers_limit import Limit
    from benchmarks.peers_runs import Run

RUN_COLUMNS = ("renderer", "setting", "CPU s", "RMSE x 255", "mean x 255")
EQUAL_COLUMNS = ("scene", "RMSE", PEER, POV, OURS, f"{OURS} / {PEER}", "goal")
ASKED_COLUMNS = ("scene", "asked", f"{PEER} at it", OURS, "true RMSE x 255", f"{OURS} / {PEER}")
FIXED_COLUMNS = ("scene", "RMSE", "target quality", "best fixed samples", "ratio")
PRECISION_COLUMNS = ("scene", "targets", "kept", "least", "median", "most")
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


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """Rows of cells for a terminal."""
    made = Table(*columns, title=title)
    for row in rows:
        made.add_row(*row)
    return made


def run_row(run: Run) -> tuple[str, ...]:
    """Cells of one setting of one renderer."""
    error, mean = f"{run['rmse_255']:.3f}", f"{run['mean_difference_255']:+.3f}"
    return run["renderer"], run["setting"], f"{run['cpu_seconds']:.2f}", error, mean


def equal_row(row: Comparison) -> tuple[str, ...]:
    """Cells of CPU seconds at equal error; `-`: not reached."""
    seconds = (cell(row["seconds"][name]) for name in (PEER, POV, OURS))
    return (
        row["scene"],
        target_name(row["error_255"]),
        *seconds,
        cell(row["over_peer"]),
        goal_name(row["goal"]),
    )


def asked_row(row: Comparison) -> tuple[str, ...]:
    """Cells of what a user gets for a target error; `-`: not measured, or not reached by Mitsuba."""
    name, peer, asked = target_name(row["error_255"]), cell(row["seconds"][PEER]), row["asked"]
    if asked is None:
        return row["scene"], name, peer, "-", "-", "-"
    true = f"{asked['rmse_255']:.3f}"
    return row["scene"], name, peer, cell(asked["cpu_seconds"]), true, cell(asked["over_peer"])


def fixed_row(row: Comparison) -> tuple[str, ...]:
    """Cells of target quality beside fixed samples."""
    seconds = (cell(row["seconds"][name]) for name in (OURS, OURS_FIXED))
    return row["scene"], target_name(row["error_255"]), *seconds, cell(row["over_fixed"])


def precision_row(row: Precision) -> tuple[str, ...]:
    """Cells of true errors over their targets."""
    ratios = (f"{row['least']:.2f}", f"{row['median']:.2f}", f"{row['most']:.2f}")
    return row["scene"], str(row["targets"]), str(row["kept"]), *ratios


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


def target_name(error_255: float) -> str:
    """Write an error as people say it.

    Examples
    --------
    >>> [target_name(error) for error in (4.0, 0.25)]
    ['4/255', '0.25/255']
    """
    return f"{error_255:g}/255"


def goal_name(goal: float | None) -> str:
    """Write a goal, or `-` where there is none.

    Examples
    --------
    >>> [goal_name(goal) for goal in (1.0, 0.35, None)]
    ['1', '0.35', '-']
    """
    return "-" if goal is None else f"{goal:g}"


def cell(value: float | None) -> str:
    """Write seconds or a ratio, or `-` where there is none.

    Examples
    --------
    >>> cell(1.234), cell(None)
    ('1.23', '-')
    """
    return "-" if value is None else f"{value:.2f}"
