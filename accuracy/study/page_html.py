"""A report as one HTML file that needs nothing else."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

from accuracy.study.blocks import Block, Heading, Paragraph, Plot, Points, Strip, Table

if TYPE_CHECKING:
    from collections.abc import Iterable

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


def page(title: str, blocks: Iterable[Block]) -> str:
    """The whole file."""
    body = "\n".join(map(_element, blocks))
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


def _element(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level}>{escape(text)}</h{level}>"
        case Paragraph(text):
            return f"<p>{escape(text)}</p>"
        case Points(items):
            told = (f"<dt>{escape(asked)}</dt><dd>{escape(answer)}</dd>" for asked, answer in items)
            return f"<dl>{''.join(told)}</dl>"
        case Table():
            return _table(block)
        case Plot(_, svg, caption):
            return f"<figure>{svg}{_caption(caption)}</figure>"
        case Strip():
            return _strip(block)


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.columns)
    rows = "\n".join(_row(row, grey=number in table.grey) for number, row in enumerate(table.rows))
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>"


def _row(cells: Iterable[str], *, grey: bool) -> str:
    told = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
    return f'<tr class="grey">{told}</tr>' if grey else f"<tr>{told}</tr>"


def _strip(strip: Strip) -> str:
    figures = (
        f'<figure><img alt="{escape(text)}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"{_caption(text)}</figure>"
        for _, png, text in strip.pictures
    )
    return f'<p>{escape(strip.caption)}</p><div class="strip">{"".join(figures)}</div>'


def _caption(text: str) -> str:
    return f"<figcaption>{escape(text)}</figcaption>"
