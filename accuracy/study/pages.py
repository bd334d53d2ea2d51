"""Pages of a report: its blocks, as one HTML file or as Markdown."""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

IMAGES = "images"
"""Folder beside the report."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222 }
body { max-width: 66rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.7rem } h2 { font-size: 1.25rem; margin-top: 2.2rem }
dt { font-weight: 600 } dd { margin: 0 0 .6rem 0 }
table { border-collapse: collapse; font-size: .85rem; display: block; overflow-x: auto }
th, td { padding: .2rem .7rem .2rem 0; text-align: left; border-bottom: 1px solid #ddd; white-space: nowrap }
tr.grey td { color: #999 }
figure { margin: 1rem 0 } figcaption { font-size: .85rem; color: #555 }
svg { max-width: 60rem; width: 100%; height: auto }
.strip { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem }
.strip figure { margin: 0 } .strip img { width: 100%; image-rendering: pixelated }
"""

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""The page loads nothing and runs nothing."""


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading; `level` 1 is the title of the report."""

    text: str
    level: int = 2


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Plain text."""

    text: str


@dataclass(frozen=True, slots=True)
class Points:
    """Questions in bold, each with its answer."""

    items: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under headings, all plain text; `grey` are the numbers of rows that matter less."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    grey: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Plot:
    """A plot: the name of its file, its SVG and what it shows."""

    name: str
    svg: str
    caption: str


@dataclass(frozen=True, slots=True)
class Strip:
    """Pictures side by side, each with its file's name, its PNG and the lines below it."""

    caption: str
    pictures: Sequence[tuple[str, bytes, str]]


Block = Heading | Paragraph | Points | Table | Plot | Strip


def html(title: str, blocks: Iterable[Block]) -> str:
    """One HTML file that needs nothing else."""
    body = "\n".join(map(_html_block, blocks))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>{STYLE}</style>
</head>
<body>
{body}
</body>
</html>
"""


def _html_block(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level}>{escape(text)}</h{level}>"
        case Paragraph(text):
            return f"<p>{escape(text)}</p>"
        case Points(items):
            pairs = (f"<dt>{escape(asked)}</dt><dd>{escape(answer)}</dd>" for asked, answer in items)
            return f"<dl>{''.join(pairs)}</dl>"
        case Table():
            return _html_table(block)
        case Plot(_, svg, caption):
            return f"<figure>{svg}{_caption(caption)}</figure>"
        case Strip():
            return _html_strip(block)


def _html_table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.columns)
    rows = "\n".join(_html_row(row, grey=number in table.grey) for number, row in enumerate(table.rows))
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>"


def _html_row(cells: Iterable[str], *, grey: bool) -> str:
    columns = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
    return f'<tr class="grey">{columns}</tr>' if grey else f"<tr>{columns}</tr>"


def _html_strip(strip: Strip) -> str:
    figures = (
        f'<figure><img alt="{escape(text)}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"{_caption(text)}</figure>"
        for _, png, text in strip.pictures
    )
    return f'<p>{escape(strip.caption)}</p><div class="strip">{"".join(figures)}</div>'


def _caption(text: str) -> str:
    return f"<figcaption>{escape(text)}</figcaption>"


def markdown(blocks: Iterable[Block]) -> str:
    """A Markdown file; its plots and pictures are files in a folder `IMAGES` beside it."""
    return "\n\n".join(map(_markdown_block, blocks)) + "\n"


def plain(text: str) -> str:
    r"""Text with the special characters of Markdown escaped.

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


def _markdown_block(block: Block) -> str:
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
