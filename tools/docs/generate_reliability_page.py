"""Write docs/explanation/reliability.md from the kept figures of `make chaos`, `soak` and `load`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tools.docs import figures
from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Mapping

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "reliability.md"
TEMPLATE = Path(__file__).with_name("reliability_template.txt")
COLUMNS = ("promise", "measured", "limit", "held")


def page(chaos: Mapping[str, Any], soak: Mapping[str, Any], load: Mapping[str, Any]) -> str:
    """The template with the tables in their places."""
    sections = {"chaos": section(chaos), "soak": _soaked(soak), "load": section(load)}
    return TEMPLATE.read_text(encoding="utf-8").format(**sections)


def _soaked(measured: Mapping[str, Any]) -> str:
    """The table of a soak, and how long each kind of fault kept the next tile away."""
    recovery = measured["promises"][0]["details"]["recovery"]
    rows = [(fault, f"{one['median']:.1f}", f"{one['worst']:.1f}") for fault, one in recovery.items()]
    return f"{section(measured)}\n\n{table(('fault', 'seconds to the next tile, median', 'worst'), rows)}"


def section(measured: Mapping[str, Any]) -> str:
    """A table in Markdown, and on what it was measured."""
    rows = [
        (found["promise"], found["measured"], found["limit"], "yes" if found["held"] else "**no**")
        for found in measured["promises"]
    ]
    return f"{table(COLUMNS, rows)}\n\n{figures.measured_on(measured['machine'])}"
