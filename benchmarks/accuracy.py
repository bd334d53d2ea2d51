"""Errors against converged pictures of another renderer, and what they cost."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, TypedDict

from benchmarks import references
from benchmarks.machine import timed_render
from benchmarks.settings import COMPARED, Setting


class Accuracy(TypedDict):
    """One setting: errors of linear values clipped to 0..1 in units of 1/255, CPU seconds of one run."""

    setting: dict[str, Any]
    cpu_seconds: float
    rmse_255: float
    mean_difference_255: float
    reference_error_255: float


def measure() -> list[Accuracy]:
    """Render every compared setting once, in one process."""
    return [_accuracy(setting) for setting in COMPARED]


def _accuracy(setting: Setting) -> Accuracy:
    converged, provenance = references.load(setting.scene)
    result, seconds = timed_render(setting.plan())
    return Accuracy(
        setting=asdict(setting),
        cpu_seconds=round(seconds, 3),
        rmse_255=round(references.rmse_255(result.image, converged), 3),
        mean_difference_255=round(references.mean_difference_255(result.image, converged), 3),
        reference_error_255=provenance.own_error_255,
    )
