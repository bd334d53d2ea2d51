"""The comparison in words: which goals are kept and which are not, and the sentence of README."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from benchmarks.peers_runs import OURS_FIXED, PEER
from benchmarks.peers_settings import FIXED_GOAL, KINDS, PRECISION_GOAL
from benchmarks.peers_tables import goal_name, target_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from benchmarks.peers_comparison import Comparison, Precision

FINE_255 = 1.0
"""README gives errors from this one down, and coarser ones, separately."""


def of_goals(rows: Sequence[Comparison]) -> list[str]:
    """One sentence for each kind of scene: at how many errors it keeps its goals, and the worst ratio."""
    return [_of_kind(kind, rows_of(kind, rows)) for kind in KINDS if rows_of(kind, rows)]


def rows_of(kind: str, rows: Iterable[Comparison]) -> list[Comparison]:
    """Those of a kind of scene whose error Mitsuba reaches."""
    return [row for row in reached(rows) if row["kind"] == kind]


def reached(rows: Iterable[Comparison]) -> list[Comparison]:
    """Those whose error Mitsuba reaches: where it does not, there is nothing to compare with."""
    return [row for row in rows if row["seconds"][PEER] is not None]


def _of_kind(kind: str, rows: Sequence[Comparison]) -> str:
    scenes = ", ".join(dict.fromkeys(row["scene"] for row in rows))
    judged = [row for row in rows if row["goal"] is not None]
    missed = [row for row in judged if _is_missed(row)]
    kept = f"{len(judged) - len(missed)} of {len(judged)} ratios are within their goals"
    worst = f"; the worst is {_missed(max(missed, key=_over_goal))}" if missed else ""
    return f"{KINDS[kind].capitalize()} ({scenes}): {kept}{worst}."


def _is_missed(row: Comparison) -> bool:
    ratio, goal = row["over_peer"], row["goal"]
    return goal is not None and (ratio is None or ratio > goal)


def _over_goal(row: Comparison) -> float:
    """How many times its goal a ratio is, infinite where the error is not reached."""
    ratio, goal = row["over_peer"], row["goal"]
    return math.inf if ratio is None or goal is None else ratio / goal


def _missed(row: Comparison) -> str:
    ratio = "not reached" if row["over_peer"] is None else f"{row['over_peer']:.2f}"
    return f"{row['scene']} at {target_name(row['error_255'])} {ratio} (goal {goal_name(row['goal'])})"


def of_fixed(rows: Iterable[Comparison]) -> str:
    """Whether target quality ever costs more than the best fixed samples of the same true error."""
    both = [row for row in rows if row["seconds"][OURS_FIXED] is not None]
    missed = [
        f"{row['scene']} at {target_name(row['error_255'])} "
        + ("not reached" if row["over_fixed"] is None else f"{row['over_fixed']:.2f}")
        for row in both
        if row["over_fixed"] is None or row["over_fixed"] > FIXED_GOAL
    ]
    goal = (
        f"The goal is at most {FIXED_GOAL:g} times the CPU seconds of the best fixed samples. It is kept in "
    )
    kept = f"{len(both) - len(missed)} of the {len(both)} rows that fixed samples reach"
    return goal + kept + (f"; worse: {', '.join(missed)}." if missed else ".")


def of_precision(rows: Iterable[Precision]) -> str:
    """Whether true errors are as close below their targets as intended."""
    low, high = PRECISION_GOAL
    missed = [f"{row['scene']} {row['median']:.2f}" for row in rows if not low <= row["median"] <= high]
    goal = f"The goal for the median is {low:g} to {high:g}. "
    return goal + (f"Not within it: {', '.join(missed)}." if missed else "Every scene is within it.")


def of_readme(rows: Sequence[Comparison]) -> str:
    """What README says of the comparison: the ratios of all scenes, at fine errors and at coarse ones."""
    fine = reached(row for row in rows if row["error_255"] <= FINE_255)
    coarse = reached(row for row in rows if row["error_255"] > FINE_255)
    return (
        f"To the same true error, {_errors(fine)}, Penumbra takes {_range(fine)} the CPU seconds of Mitsuba, "
        f"a compiled renderer{_never(fine)}. "
        f"To coarser ones, {_errors(coarse)}, it takes {_range(coarse)}{_never(coarse)}."
    )


def _errors(rows: Sequence[Comparison]) -> str:
    errors = [row["error_255"] for row in rows]
    return f"from {target_name(max(errors))} to {target_name(min(errors))}"


def _ratios(rows: Iterable[Comparison]) -> list[float]:
    return [row["over_peer"] for row in rows if row["over_peer"] is not None]


def _range(rows: Sequence[Comparison]) -> str:
    """The least and the most ratio."""
    ratios = _ratios(rows)
    ends = dict.fromkeys(f"{ratio:.2g}" for ratio in (min(ratios), max(ratios))) if ratios else ()
    return f"{' to '.join(ends) or '-'} times"


def _never(rows: Sequence[Comparison]) -> str:
    """How many comparisons have no ratio: Penumbra does not reach their error."""
    missing = len(rows) - len(_ratios(rows))
    return f" (not reached in {missing} of {len(rows)} comparisons)" if missing else ""
