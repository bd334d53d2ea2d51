"""Sentences for students about a region of a picture, and about mistakes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from schemas.api.comparisons import ComparisonCause, ComparisonRegion

LEAST_SHARE = 0.1
"""Share of the squared difference below which a region is not reported."""

TOO_LITTLE = (
    "Without its mistakes too little of the picture is left to judge: most of it is white, black or of one "
    "colour, or too coarse. Correct them first."
)
"""Message to a student whose picture cannot be judged after its mistakes were undone."""


def explained(causes: Sequence[ComparisonCause], regions: Sequence[ComparisonRegion]) -> str:
    """The mistakes that explain a difference, or else the region with most of it."""
    if causes:
        return " ".join(f"Probable cause: {each.cause}. {each.hint}" for each in causes)
    if regions and regions[0].share >= LEAST_SHARE:
        return f"Look at {place(regions[0])}"
    return ""


def place(region: ComparisonRegion) -> str:
    """A region of a picture and its error."""
    brightness = "too bright" if region.brightness > 0 else "too dark"
    name = f", mostly {region.name}" if region.name else ""
    return (
        f"columns {region.x0} to {region.x1 - 1}, rows {region.y0} to {region.y1 - 1}{name}: {brightness} by "
        f"{abs(region.brightness):.3f} on average, {100 * region.share:.0f} % of the squared difference."
    )


def judged_without(causes: Sequence[str], tests: Iterable[str]) -> str:
    """Mistakes that a picture is judged without, and the tests in which they cost points; else empty."""
    if not causes:
        return ""
    where = " and ".join(tests)
    price = f"it costs points in {where}." if where else "it costs no points here."
    return f"It is judged as if {' and '.join(causes)} were fixed: {price}"


def joined(*sentences: str | None) -> str:
    """Join sentences, skipping empty ones."""
    return " ".join(sentence for sentence in sentences if sentence)
