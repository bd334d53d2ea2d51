"""Markdown of pages: templates with their placeholders, and tables."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

PLACE = re.compile(r"^\{(\w+)\}$", re.MULTILINE)
"""A placeholder: a name alone in its line. Other braces are text, such as those of paths."""

BAR = re.compile(r"(?<!\\)\|")
"""A bar that is not escaped yet."""


def filled(template: Path, part: Callable[[str], str]) -> str:
    """A template with the part of each name in its place."""
    return PLACE.sub(lambda place: part(place[1]), template.read_text(encoding="utf-8"))


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are Markdown."""
    return table_rows([columns, ["---"] * len(columns), *rows])


def table_rows(rows: Iterable[Sequence[str]]) -> str:
    """Rows of a table, for a template that has its head; a bar in a cell is part of its text."""
    cells = ([BAR.sub(r"\\|", cell) for cell in row] for row in rows)
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)
