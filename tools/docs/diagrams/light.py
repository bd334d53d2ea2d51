"""Diagrams of shadows: why they are soft, and how a ray leaves a surface without an epsilon."""

from __future__ import annotations

from tools.docs.diagrams.drawing import (
    BLOCKED,
    FAINT,
    INK,
    LIGHT,
    OPEN,
    SMALL,
    SOLID,
    Place,
    arrow,
    box,
    dot,
    label,
    labels,
    line,
    picture,
)

PANEL = 240
"""Width of one of three pictures side by side."""


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
        310,
        "Umbra and penumbra",
        "A lamp above a bar. Below the bar is an umbra, on both sides of it a penumbra, then full light. Of "
        "four shadow rays from a point in the penumbra the bar blocks two.",
        [
            f'<defs><linearGradient id="shade">{shade}</linearGradient></defs>',
            line((40, floor), (680, floor)),
            box((40, floor + 2), (640, 16), "url(#shade)"),
            line((lamp[0], lamp[2]), (lamp[1], lamp[2]), LIGHT, width=6),
            line((bar[0], bar[2]), (bar[1], bar[2]), SOLID, width=10),
            *rays,
            dot(point),
            label((360, 26), "lamp"),
            label((412, 145), "shape", anchor="start"),
            label((point[0] - 14, 240), "two of four points: V = 1/2", anchor="end"),
            label((120, 300), "full light"),
            label(((edges[0] + edges[1]) / 2, 300), "penumbra"),
            label((360, 300), "umbra"),
            label(((edges[2] + edges[3]) / 2, 300), "penumbra"),
            label((600, 300), "full light"),
        ],
    )


def seen_from(lamp: Place, edge: Place, floor: float) -> float:
    """Where on the floor the line from a place of the lamp past an edge ends."""
    return lamp[0] + (edge[0] - lamp[0]) * (floor - lamp[1]) / (edge[1] - lamp[1])


def shadow_ray(point: Place, target: Place, bar: tuple[float, float, float]) -> str:
    """A ray to the lamp, up to the bar where that is in its way."""
    share = (point[1] - bar[2]) / (point[1] - target[1])
    crossing = point[0] + (target[0] - point[0]) * share
    is_blocked = bar[0] <= crossing <= bar[1]
    end = (crossing, bar[2]) if is_blocked else target
    return arrow(point, end, BLOCKED if is_blocked else OPEN, dashed=is_blocked)


def epsilon() -> str:
    """A small step on the floor: a ray with an epsilon, without one, and as it should be."""
    return picture(
        214,
        "What an epsilon does",
        "Three rays from a point on a floor to the light. One begins a rounding below the floor, which "
        "blocks it. The others have a small step in their way: one whose origin is moved up by an epsilon "
        "passes above the step, and one that begins on the floor hits it.",
        [
            *_step(0, -10.0, ("rounded to below the floor:", "the floor shades itself")),
            *_step(PANEL, 24.0, ("moved up by an epsilon:", "light leaks over the step")),
            *_step(2 * PANEL, 0.0, ("left where it is:", "the step blocks the light")),
        ],
    )


def _step(left: float, moved: float, texts: tuple[str, str]) -> list[str]:
    """One panel: the floor, a step unless the floor itself is in the way, and a ray from a moved place."""
    floor, height = 190.0, 14.0
    place, near, far, right = left + 60, left + 90, left + 130, left + PANEL - 14
    begin = (place, floor - moved)
    slope = -0.4
    at_step = begin[1] + slope * (near - begin[0])
    if moved < 0:
        end = (begin[0] + moved / slope, floor)
    elif at_step > floor - height:
        end = (near, at_step)
    else:
        end = (right, begin[1] + slope * (right - begin[0]))
    is_blocked = end[0] < right
    parts = [
        line((left + 14, floor), (right, floor)),
        *([box((near, floor - height), (far - near, height), SOLID)] if moved >= 0 else []),
        labels((left + PANEL / 2, 28), texts, size=14),
        label((right, 78), "to the light", anchor="end", size=SMALL),
        arrow((right - 58, 103), (right - 18, 87), LIGHT),
    ]
    if is_blocked:
        parts.append(line(end, (right, end[1] + slope * (right - end[0])), FAINT))
    return [*parts, arrow(begin, end, BLOCKED if is_blocked else OPEN, dashed=is_blocked), dot(begin)]


def sides() -> str:
    """The rules by which a point is on a definite side of every surface."""
    return picture(
        290,
        "Which side of a surface a ray begins on",
        "Three cases of a point x that a path reached from the place o. On the surface that it leaves its "
        "distance counts as 0. Within the rounding bound of another surface, a wall, it counts as on the "
        "side of o, although the computed x is behind the wall. Farther from a wall than the bound the "
        "computed side counts.",
        [*_leaves(0), *_touches(PANEL), *_apart(2 * PANEL)],
    )


FLOOR = 190.0


def _leaves(left: float) -> list[str]:
    """The surface that the point lies on."""
    x = (left + 120, FLOOR + 7)
    return [
        *_heading(left, "the surface that it leaves", ("x has the distance 0:", "it is not hit again")),
        *_band((left + 16, FLOOR), (left + 224, FLOOR)),
        line((left + 16, FLOOR), (left + 224, FLOOR), width=2.5),
        *_path((left + 44, 92), x),
        arrow(x, (left + 200, 92), OPEN),
        label((left + 206, 84), "q"),
    ]


def _touches(left: float) -> list[str]:
    """A wall that meets the floor where the point is."""
    x, wall = (left + 146, FLOOR), left + 138
    return [
        *_heading(left, "one that it touches", ("x counts as on o's side:", "p is blocked, q is not")),
        *_band((wall, 76), (wall, FLOOR)),
        line((left + 16, FLOOR), (left + 224, FLOOR)),
        line((wall, 76), (wall, FLOOR), width=2.5),
        *_path((left + 36, 112), x),
        arrow(x, (left + 88, 84), OPEN),
        arrow(x, (left + 206, 98), BLOCKED, dashed=True),
        label((left + 84, 76), "q"),
        label((left + 214, 92), "p"),
    ]


def _apart(left: float) -> list[str]:
    """A wall at some distance."""
    x, wall = (left + 92, FLOOR), left + 160
    end = (wall, FLOOR - (wall - x[0]) * 0.85)
    return [
        *_heading(left, "one beyond the bound", ("the computed side is right:", "the wall blocks p")),
        *_band((wall, 76), (wall, FLOOR)),
        line((left + 16, FLOOR), (left + 224, FLOOR)),
        line((wall, 76), (wall, FLOOR), width=2.5),
        *_path((left + 36, 112), x),
        line(end, (left + 212, FLOOR - 120 * 0.85), FAINT),
        arrow(x, end, BLOCKED, dashed=True),
        label((left + 218, 82), "p"),
    ]


def _heading(left: float, text: str, rule: tuple[str, str]) -> list[str]:
    """What a panel is about, and what follows."""
    return [
        label((left + PANEL / 2, 30), text, bold=True),
        labels((left + PANEL / 2, FLOOR + 52), rule, size=14),
    ]


def _band(begin: Place, end: Place, bound: float = 16) -> list[str]:
    """How far rounding may move a point, on both sides of a surface."""
    across, down = (bound, 0) if begin[0] == end[0] else (0, bound)
    return [
        line(
            (begin[0] + way * across, begin[1] + way * down),
            (end[0] + way * across, end[1] + way * down),
            SOLID,
            width=1,
            dashed=True,
        )
        for way in (-1, 1)
    ]


def _path(origin: Place, x: Place) -> list[str]:
    """The ray before, from o to x."""
    return [
        line(origin, x, SOLID),
        dot(origin, SOLID),
        dot(x),
        label((origin[0] - 12, origin[1] + 5), "o"),
        label((x[0] + 2, x[1] + 20), "x"),
    ]
