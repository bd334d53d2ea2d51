"""Materials of CS171 scenes: ideally diffuse, ideal mirrors, and glass."""

from __future__ import annotations

from typing import Any

from service.converting.assumptions import Notes
from service.converting.course_document import CourseMaterial

GLASS = frozenset({"translucent", "transmission"})
"""What students call it; the skeleton itself has `diffuse` and `specular` alone."""
REFRACTIVE_INDEX = 1.5
DEEPEST = 64
"""Most bounces that a material may have."""
DEFAULT_DEPTH = 5
"""Bounces where `max_depth` is missing: the default of scenes."""


def material(written: CourseMaterial, pointer: str, max_depth: int | None, notes: Notes) -> dict[str, Any]:
    """One material of a scene; what has no counterpart is noted."""
    kind = written.type.lower()
    if kind == "specular":
        return _share("mirror", written, pointer, max_depth, notes)
    if kind in GLASS:
        notes.assume(f"{pointer}/type", f"It is glass with a refractive index of {REFRACTIVE_INDEX}.")
        glass = _share("transmission", written, pointer, max_depth, notes)
        return glass | {"ior": REFRACTIVE_INDEX}
    if kind != "diffuse":
        notes.assume(
            f"{pointer}/type",
            "The type is not known, so it is diffuse. Known are diffuse, specular, translucent.",
        )
    return {"type": "phong", "color": written.color}


def _share(
    field: str, written: CourseMaterial, pointer: str, max_depth: int | None, notes: Notes
) -> dict[str, Any]:
    """A material that sends rays on and does nothing else."""
    red, green, blue = written.color
    share = min(1.0, (red + green + blue) / 3)
    if not red == green == blue == share:
        notes.assume(
            f"{pointer}/color",
            f"Rays are sent on with one share for all colours, at most 1: {share:.6g}, the mean of this one.",
        )
    depth = max(1, min(DEEPEST, max_depth if max_depth is not None else DEFAULT_DEPTH))
    if max_depth is not None and depth != max_depth:
        notes.assume(
            "/max_depth", f"Mirrors and glass send rays on {depth} times: 1 to {DEEPEST} are possible."
        )
    return {
        "type": "phong",
        "color": written.color,
        "ambient": 0,
        "diffuse": 0,
        field: share,
        "max_depth": depth,
    }
