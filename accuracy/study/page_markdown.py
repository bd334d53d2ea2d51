"""A report in Markdown, with its plots and pictures in files beside it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from accuracy.study.blocks import Block, Heading, Paragraph, Plot, Points, Strip, Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

IMAGES = "images"
"""Folder beside the report."""


def page(blocks: Iterable[Block]) -> str:
    """The whole file."""
    return "\n\n".join(map(_text, blocks)) + "\n"


def plain(text: str) -> str:
    r"""Text that Markdown shows as it is.

    Examples
    --------
    >>> plain("/materials/a_b|c*")
    '/materials/a\\_b\\|c\\*'
    """
    return re.sub(r"([\\`*_\[\]<>|#])", r"\\\1", text)


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain text."""
    lines = [columns, ["---"] * len(columns), *([plain(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _text(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {plain(text)}"
        case Paragraph(text):
            return plain(text)
        case Points(items):
            return "\n".join(f"- **{plain(asked)}** {plain(answer)}" for asked, answer in items)
        case Table(columns, rows):
            return table(columns, rows)
        case Plot(name, _, caption):
            return f"![{plain(caption)}]({IMAGES}/{name}.svg)\n\n{plain(caption)}"
        case Strip(caption, pictures):
            shown = [f"![{plain(text)}]({IMAGES}/{name})" for name, _, text in pictures]
            below = [text for _, _, text in pictures]
            return f"{plain(caption)}\n\n{_grid(shown, below)}"


def _grid(shown: Sequence[str], below: Sequence[str], columns: int = 3) -> str:
    lines = []
    for first in range(0, len(shown), columns):
        cells = list(shown[first : first + columns])
        texts = [plain(text) for text in below[first : first + columns]]
        missing = [""] * (min(columns, len(shown)) - len(cells))
        lines += [cells + missing, texts + missing]
        if first == 0:
            lines.insert(1, ["---"] * len(cells))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
