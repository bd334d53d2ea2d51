"""Sentences for students about a number, a region, and a mistake."""

from __future__ import annotations

from collections.abc import Sequence

from schemas.api.comparisons import ComparisonCause, ComparisonRegion
from schemas.grading.acceptance import Scale

LEAST_SHARE = 0.1
"""Share of the squared difference below which a region is not reported."""


def held(metric: str, value: float, scale: Scale) -> str:
    """A number and its threshold."""
    side = "more" if scale.rising else "less"
    return f"{metric} is {value:.4g}; {scale.full:.4g} or {side} earns all points."


def explained(causes: Sequence[ComparisonCause], regions: Sequence[ComparisonRegion]) -> str:
    """The mistake that explains a difference, or else the region with most of it."""
    if causes:
        return f"Probable cause: {causes[0].cause}. {causes[0].hint}"
    if regions and regions[0].share >= LEAST_SHARE:
        return f"Look at {place(regions[0])}"
    return ""


def place(region: ComparisonRegion) -> str:
    """A region of a picture and its error."""
    brightness = "too bright" if region.brightness > 0 else "too dark"
    name = f", mostly {region.name}" if region.name else ""
    return (
        f"columns {region.x0} to {region.x1 - 1}, rows {region.y0} to {region.y1 - 1}{name}: {brightness} by "
        f"{abs(region.brightness):.3f} on average, {region.share:.0%} of the squared difference."
    )


def joined(*sentences: str | None) -> str:
    """Join sentences, skipping empty ones."""
    return " ".join(sentence for sentence in sentences if sentence)
