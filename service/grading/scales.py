"""Outcomes of a number on a scale: its share of the points, and its margin from the threshold."""

from __future__ import annotations

import math

from accuracy.comparison.metrics import ROUNDING_BOUND
from schemas.grading.acceptance import Scale
from service.grading.outcomes import Outcome


def by_number(metric: str, value: float, scale: Scale) -> Outcome:
    """The outcome of a test that a single number decides."""
    side = "more" if scale.rising else "less"
    return Outcome(
        share=share_of(value, scale),
        message=f"{metric} is {value:.4g}; {scale.full:.4g} or {side} earns all points.",
        metric=metric,
        value=value if math.isfinite(value) else None,
        threshold=scale.full,
        margin=margin_of(value, scale),
    )


def share_of(value: float, scale: Scale) -> float:
    """The share of the points that a value earns, 0 to 1.

    A value that misses a threshold only by rounding reaches it.

    >>> from schemas.grading.acceptance import RayShare
    >>> share_of(0.75, RayShare(full=1.0, zero=0.5))
    0.5
    """
    if reached(value, scale.full, rising=scale.rising):
        return 1.0
    for band in scale.bands:
        if reached(value, band.at, rising=scale.rising):
            return band.share
    if scale.zero is None or reached(scale.zero, value, rising=scale.rising):
        return 0.0
    return (scale.zero - value) / (scale.zero - scale.full)


def reached(value: float, threshold: float, *, rising: bool) -> bool:
    """Whether a value is as good as a threshold, up to rounding."""
    beyond = value - threshold if rising else threshold - value
    return beyond >= -ROUNDING_BOUND * max(1.0, abs(threshold)) if math.isfinite(value) else beyond > 0


def margin_of(value: float, scale: Scale) -> float | None:
    """Margin of a value beyond the threshold for full points, relative to the threshold.

    0 if they differ only by rounding; None if the margin is undefined.
    """
    beyond = value - scale.full if scale.rising else scale.full - value
    if scale.full == 0 or not math.isfinite(beyond):
        return None
    return 0.0 if abs(beyond) <= ROUNDING_BOUND * max(1.0, scale.full) else beyond / scale.full
