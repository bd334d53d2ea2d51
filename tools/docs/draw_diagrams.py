"""Draw the diagrams of the explanations, in docs/images/diagrams.

Run it with ``python tools/docs/draw_diagrams.py``. Rays end where they hit: the places are computed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

FOLDER = Path(__file__).parents[2] / "docs" / "images" / "diagrams"

LIGHT, OPEN, BLOCKED, SOLID, INK = "#e0a100", "#117733", "#cc3311", "#777777", "#222222"
"""Colours that people with any colour vision can distinguish; blocked rays are dashed too."""

Place = tuple[float, float]


def diagrams() -> dict[str, str]:
    """Each diagram by the name of its file."""
    return {"penumbra.svg": penumbra(), "epsilon.svg": epsilon()}


def penumbra() -> str:
    """A lamp, a bar below it, and the floor: where it is light, half light and dark, and why."""
    # The left and the right end of each, and its height in the picture.
    lamp, bar, floor = (300.0, 420.0, 40.0), (320.0, 400.0, 140.0), 260.0
    edges = [
        seen_from((lamp[i], lamp[2]), (bar[j], bar[2]), floor) for j, i in ((0, 1), (0, 0), (1, 1), (1, 0))
    ]
    point = ((edges[0] + edges[1]) / 2, floor)
    stops = zip(edges, (0, 1, 1, 0), strict=True)
    shade = "".join(
        f'<stop offset="{(x - 40) / 640:.4f}" stop-color="{INK}" stop-opacity="{0.85 * dark:g}"/>'
        for x, dark in stops
    )
    rays = [
        shadow_ray(point, (lamp[0] + (lamp[1] - lamp[0]) * (i + 0.5) / 4, lamp[2]), bar) for i in range(4)
    ]
    return picture(
        (720, 310),
        [
            f'<defs><linearGradient id="shade">{shade}</linearGradient></defs>',
            line((40, floor), (680, floor), INK),
            box((40, floor + 2), (640, 16), "url(#shade)"),
            line((lamp[0], lamp[2]), (lamp[1], lamp[2]), LIGHT, width=6),
            line((bar[0], bar[2]), (bar[1], bar[2]), SOLID, width=10),
            *rays,
            f'<circle cx="{point[0]:g}" cy="{point[1]:g}" r="4" fill="{INK}"/>',
            label((360, 26), "lamp"),
            label((412, 145), "shape", anchor="start"),
            label((120, 300), "full light"),
            label(((edges[0] + edges[1]) / 2, 300), "penumbra"),
            label((360, 300), "umbra"),
            label(((edges[2] + edges[3]) / 2, 300), "penumbra"),
            label((600, 300), "full light"),
        ],
    )


def epsilon() -> str:
    """A small step on the floor: a ray that begins on the floor hits it, one that was moved up does not."""
    return picture(
        (720, 230),
        [
            *step(0, 24.0),
            *step(360, 0.0),
            label((180, 30), "origin moved by a constant: light leaks"),
            label((540, 30), "origin where it is: in shadow"),
        ],
    )


def step(left: float, moved: float) -> list[str]:
    """One half of the picture: the floor, the step, and a ray from a place that is moved up."""
    floor, height = 190.0, 14.0
    begin, near, far = (left + 90, floor - moved), left + 110, left + 150
    slope = -0.4
    at_step = begin[1] + slope * (near - begin[0])
    is_blocked = at_step > floor - height
    end = (near, at_step) if is_blocked else (left + 300, begin[1] + slope * (left + 300 - begin[0]))
    parts = [
        line((left + 30, floor), (left + 330, floor), INK),
        box((near, floor - height), (far - near, height), SOLID),
        line(begin, end, BLOCKED if is_blocked else OPEN, dashed=is_blocked),
        f'<circle cx="{left + 90:g}" cy="{floor:g}" r="4" fill="{INK}"/>',
        label((left + 310, 70), "to the light", anchor="end"),
    ]
    if moved:
        parts.append(f'<circle cx="{begin[0]:g}" cy="{begin[1]:g}" r="4" fill="none" stroke="{INK}"/>')
    return parts


def seen_from(lamp: Place, edge: Place, floor: float) -> float:
    """Where on the floor the line from a place of the lamp past an edge ends."""
    return lamp[0] + (edge[0] - lamp[0]) * (floor - lamp[1]) / (edge[1] - lamp[1])


def shadow_ray(point: Place, target: Place, bar: tuple[float, float, float]) -> str:
    """A ray to the lamp, up to the bar where that is in its way."""
    share = (point[1] - bar[2]) / (point[1] - target[1])
    crossing = point[0] + (target[0] - point[0]) * share
    is_blocked = bar[0] <= crossing <= bar[1]
    end = (crossing, bar[2]) if is_blocked else target
    return line(point, end, BLOCKED if is_blocked else OPEN, dashed=is_blocked)


def line(begin: Place, end: Place, color: str, *, width: float = 1.5, dashed: bool = False) -> str:
    """A straight line."""
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    places = f'x1="{begin[0]:.1f}" y1="{begin[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}"'
    return f'<line {places} stroke="{color}" stroke-width="{width:g}"{dashes}/>'


def box(corner: Place, size: Place, color: str) -> str:
    """A filled rectangle, by its upper left corner."""
    places = f'x="{corner[0]:g}" y="{corner[1]:g}" width="{size[0]:g}" height="{size[1]:g}"'
    return f'<rect {places} fill="{color}"/>'


def label(place: Place, text: str, *, anchor: str = "middle") -> str:
    """A word beside what it names."""
    return f'<text x="{place[0]:.1f}" y="{place[1]:.1f}" text-anchor="{anchor}" fill="{INK}">{text}</text>'


def picture(size: tuple[int, int], parts: Iterable[str]) -> str:
    """A whole file; its background is white, so that it can be read on a dark page too."""
    width, height = size
    shape = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" {shape} font-family="sans-serif" font-size="14">',
            box((0, 0), size, "white"),
            *parts,
            "</svg>\n",
        ]
    )


def main() -> None:
    """Write all of them."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in diagrams().items():
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
