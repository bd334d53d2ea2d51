"""The parts of a diagram: lines, arrows, boxes, labels, and the file around them.

Places are in pixels, x to the right and y downwards. A picture is 720 pixels wide, the width of a column of
text, so that its labels are shown about as large as they are here.
"""

from __future__ import annotations

from html import escape
from math import hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

WIDTH = 720

INK, SOLID, FAINT, PAPER = "#222222", "#777777", "#dddddd", "#ffffff"
LIGHT, OPEN, BLOCKED = "#e0a100", "#0077bb", "#cc3311"
"""Colours that people with any colour vision can distinguish. None carries a meaning alone: what is blocked
or lost is dashed or crossed too."""

TEXT, SMALL = 14, 12
"""Sizes of labels, pixels; smaller ones are hard to read."""

Place = tuple[float, float]


def line(begin: Place, end: Place, color: str = INK, *, width: float = 1.5, dashed: bool = False) -> str:
    """A straight line."""
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    places = f'x1="{begin[0]:.1f}" y1="{begin[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}"'
    return f'<line {places} stroke="{color}" stroke-width="{width:g}"{dashes}/>'


def arrow(begin: Place, end: Place, color: str = INK, *, dashed: bool = False) -> str:
    """A straight line with a head at its end."""
    across, down = end[0] - begin[0], end[1] - begin[1]
    x, y = across / hypot(across, down), down / hypot(across, down)
    back = end[0] - 8 * x, end[1] - 8 * y
    head = [end, (back[0] - 4 * y, back[1] + 4 * x), (back[0] + 4 * y, back[1] - 4 * x)]
    return line(begin, back, color, dashed=dashed) + polygon(head, color)


def polygon(corners: Sequence[Place], color: str) -> str:
    """A filled polygon."""
    return f'<polygon points="{_points(corners)}" fill="{color}"/>'


def curve(places: Sequence[Place], color: str = INK, *, width: float = 1.5) -> str:
    """A line through many places."""
    return f'<polyline points="{_points(places)}" fill="none" stroke="{color}" stroke-width="{width:g}"/>'


def box(
    corner: Place,
    size: Place,
    color: str = PAPER,
    *,
    edge: str = "",
    round_by: float = 0,
    dashed: bool = False,
) -> str:
    """A rectangle, by its upper left corner."""
    places = f'x="{corner[0]:g}" y="{corner[1]:g}" width="{size[0]:g}" height="{size[1]:g}"'
    corners = f' rx="{round_by:g}"' if round_by else ""
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    stroke = f' stroke="{edge}" stroke-width="1.5"{dashes}' if edge else ""
    return f'<rect {places} fill="{color}"{corners}{stroke}/>'


def dot(place: Place, color: str = INK, *, radius: float = 4, hollow: bool = False) -> str:
    """A small circle."""
    inside = f'fill="{PAPER}" stroke="{color}" stroke-width="1.5"' if hollow else f'fill="{color}"'
    return f'<circle cx="{place[0]:.1f}" cy="{place[1]:.1f}" r="{radius:g}" {inside}/>'


def diamond(place: Place, color: str = INK, *, radius: float = 6) -> str:
    """A small square on its corner."""
    x, y = place
    return polygon([(x - radius, y), (x, y - radius), (x + radius, y), (x, y + radius)], color)


def cross(place: Place, color: str = BLOCKED, *, radius: float = 7) -> str:
    """What ends something."""
    x, y = place
    falling = line((x - radius, y - radius), (x + radius, y + radius), color, width=3)
    return falling + line((x - radius, y + radius), (x + radius, y - radius), color, width=3)


def loop(foot: Place) -> str:
    """An arrow from the top of a box back to it; `foot` is the middle of that top."""
    x, y = foot
    way = f"M {x - 18:g} {y:g} C {x - 26:g} {y - 40:g}, {x + 26:g} {y - 40:g}, {x + 18:g} {y - 6:g}"
    head = polygon([(x + 16, y), (x + 13, y - 9), (x + 22, y - 7)], INK)
    return f'<path d="{way}" fill="none" stroke="{INK}" stroke-width="1.5"/>{head}'


def label(
    place: Place,
    text: str,
    *,
    anchor: str = "middle",
    size: int = TEXT,
    color: str = INK,
    bold: bool = False,
    halo: bool = False,
) -> str:
    """Words; `place` is on their baseline. A `halo` keeps them apart from lines behind them."""
    font = f' font-size="{size}"' if size != TEXT else ""
    weight = ' font-weight="bold"' if bold else ""
    around = f' paint-order="stroke" stroke="{PAPER}" stroke-width="4"' if halo else ""
    where = f'x="{place[0]:.1f}" y="{place[1]:.1f}" text-anchor="{anchor}"'
    return f'<text {where} fill="{color}"{font}{weight}{around}>{escape(text, quote=False)}</text>'


def labels(place: Place, texts: Iterable[str], *, anchor: str = "middle", size: int = SMALL) -> str:
    """Several lines of words, the first at a place."""
    step = size + 4
    return "".join(
        label((place[0], place[1] + step * i), text, anchor=anchor, size=size) for i, text in enumerate(texts)
    )


def picture(height: int, title: str, description: str, parts: Iterable[str]) -> str:
    """A whole file, with words for screen readers.

    Its background is white, so that it can be read on a dark page too.
    """
    shape = f'viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}"'
    words = 'role="img" aria-labelledby="title description"'
    font = f'font-family="sans-serif" font-size="{TEXT}"'
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" {shape} {words} {font}>',
            f'<title id="title">{escape(title, quote=False)}</title>',
            f'<desc id="description">{escape(description, quote=False)}</desc>',
            box((0, 0), (WIDTH, height)),
            *parts,
            "</svg>\n",
        ]
    )


def _points(places: Iterable[Place]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
