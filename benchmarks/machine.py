"""On what the figures were measured, and how CPU time is counted."""

from __future__ import annotations

import resource
import statistics
from typing import TYPE_CHECKING, TypedDict

import renderer
from accuracy.study.journal import Machine, describe

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Machine", "Spread", "cpu_seconds", "describe", "render_seconds", "spread", "timed_render"]


def cpu_seconds() -> float:
    """User and system time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def timed_render(
    plan: renderer.RenderPlan, workers: int | None = None
) -> tuple[renderer.RenderResult, float]:
    """Render a plan, and give the CPU seconds that it took beside the result."""
    begun = cpu_seconds()
    result = renderer.render(plan, workers=workers)
    return result, cpu_seconds() - begun


def render_seconds(plan: renderer.RenderPlan, workers: int | None = None) -> float:
    """CPU seconds of rendering a plan."""
    return timed_render(plan, workers)[1]


class Spread(TypedDict):
    """Several runs of the same thing, in seconds."""

    median: float
    least: float
    most: float
    runs: int


def spread(seconds: Sequence[float]) -> Spread:
    """Summarise several runs.

    Examples
    --------
    >>> spread([3.0, 1.0, 2.0])
    {'median': 2.0, 'least': 1.0, 'most': 3.0, 'runs': 3}
    """
    return Spread(
        median=round(statistics.median(seconds), 4),
        least=round(min(seconds), 4),
        most=round(max(seconds), 4),
        runs=len(seconds),
    )
