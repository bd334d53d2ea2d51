"""Diagrams of errors: what interpolation misses, how probes measure it, and how often intervals hold."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from math import exp
from random import Random
from typing import TYPE_CHECKING, Any

from tools.docs import figures
from tools.docs.diagrams.drawing import (
    BLOCKED,
    FAINT,
    INK,
    LIGHT,
    OPEN,
    SMALL,
    SOLID,
    Place,
    box,
    curve,
    diamond,
    dot,
    label,
    labels,
    line,
    picture,
    polygon,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

PIXELS = 32
"""Of a row of a picture, between its first and its last pilot sample."""
STRIDE, ALLOWED, PROBE = 4, 0.022, 18
"""Of the first lattice; what interpolation may err by; and the pixel that is a probe."""


def interpolation() -> str:
    """A row of pixels: where pilot samples were taken, what is interpolated, and what that misses."""
    pilots = sorted(_pilots())
    missed = [polygon(_gap(a, b), LIGHT) for a, b in pairwise(pilots) if b - a > 1]
    between = [n for n in range(PIXELS + 1) if n not in pilots]
    guess = _at(PROBE, _interpolated(PROBE, pilots))
    truth = _at(PROBE, brightness(PROBE))
    return picture(
        320,
        "Pilot samples, interpolated pixels and a probe",
        "The brightness along a row of pixels. Pilot samples are four pixels apart where the curve is smooth "
        "and one pixel apart at the edge of a shadow; straight lines join them. A thin dark line lies "
        "between two pilot samples, so that interpolation misses it. A probe in that place measures the "
        "difference.",
        [
            line(_at(0, 0), _at(PIXELS, 0)),
            line(_at(0, 0), _at(0, 1)),
            label((52, 26), "brightness", anchor="start", size=SMALL),
            label((690, 268), "pixels of a row", anchor="end", size=SMALL),
            *missed,
            curve([_at(n / 20, brightness(n / 20)) for n in range(20 * PIXELS + 1)]),
            *(dot(_at(n, _interpolated(n, pilots)), SOLID, radius=3, hollow=True) for n in between),
            *(dot(_at(n, brightness(n)), OPEN) for n in pilots),
            line(guess, truth, BLOCKED, width=2),
            diamond(truth, BLOCKED),
            label((truth[0] - 14, truth[1] + 5), "a probe finds what pilot samples missed", anchor="end"),
            *_legend(),
        ],
    )


def _legend() -> list[str]:
    """What the signs mean."""
    y = 300
    return [
        line((44, y), (70, y)),
        label((78, y + 5), "true", anchor="start"),
        dot((140, y), OPEN),
        label((150, y + 5), "pilot sample", anchor="start"),
        dot((262, y), SOLID, radius=3, hollow=True),
        label((272, y + 5), "interpolated", anchor="start"),
        diamond((382, y), BLOCKED),
        label((394, y + 5), "probe", anchor="start"),
        box((462, y - 7), (22, 14), LIGHT),
        label((492, y + 5), "error of interpolation", anchor="start"),
    ]


def brightness(place: float) -> float:
    """Light that falls off, a thin dark line, and the edge of a soft shadow."""
    lit = 0.4 + 0.5 * exp(-(((place - 9) / 10) ** 2))
    edge = min(max((place - 24.2) / 2, 0.0), 1.0)
    shadow = 1 - 0.8 * edge * edge * (3 - 2 * edge)
    return lit * shadow * (1 - 0.7 * exp(-(((place - 17.9) / 0.6) ** 4)))


def _pilots() -> set[int]:
    """Pixels with a pilot sample: the lattice, and finer ones where second differences are large."""
    nodes, stride = set(range(0, PIXELS + 1, STRIDE)), STRIDE
    while stride > 1:
        bends = {
            n: abs(brightness(n - stride) - 2 * brightness(n) + brightness(n + stride)) / 8
            for n in range(stride, PIXELS, stride)
        }
        for n in range(0, PIXELS, stride):
            if n in nodes and max(bends.get(n, 0.0), bends.get(n + stride, 0.0)) > ALLOWED:
                nodes.add(n + stride // 2)
        stride //= 2
    return nodes


def _interpolated(pixel: int, pilots: list[int]) -> float:
    """The value that a pixel shows."""
    low, high = max(n for n in pilots if n <= pixel), min(n for n in pilots if n >= pixel)
    share = (pixel - low) / (high - low) if high > low else 0.0
    return brightness(low) + share * (brightness(high) - brightness(low))


def _gap(low: int, high: int) -> list[Place]:
    """The outline of what lies between the true brightness and the straight line between two pilots."""
    steps = 20 * (high - low)
    return [_at(low + n / 20, brightness(low + n / 20)) for n in range(steps + 1)]


def _at(pixel: float, value: float) -> Place:
    """Where a pixel and its brightness are drawn."""
    return 44 + 20.2 * pixel, 250 - 230 * value


INTERPOLATED, PILOT, BORDER = "interpolated", "pilot sample", "border"
STRATA = {INTERPOLATED: (FAINT, 1 / 16), PILOT: ("#88ccee", 1 / 8), BORDER: (LIGHT, 1 / 2)}
"""Colour of each stratum, and the probability that one of its pixels is a probe."""
COLUMNS, ROWS, SIDE = 24, 15, 14
SEED = 5


def probes() -> str:
    """Pixels in three strata, the probes among them, and how they give a sum over all pixels."""
    pixels = {(x, y): _stratum(x, y) for y in range(ROWS) for x in range(COLUMNS)}
    ranks = Random(SEED)  # noqa: S311  (a drawing)
    chosen = [place for place, name in pixels.items() if ranks.random() < STRATA[name][1]]
    sizes, counts = Counter(pixels.values()), Counter(pixels[place] for place in chosen)
    return picture(
        270,
        "Strata and probes",
        "A picture of a ball. Its pixels are in three strata: interpolated, pilot samples, and borders of "
        "the ball. Some pixels of each stratum, chosen at random, are probes; of the border about half.",
        [
            *(
                box((30 + SIDE * x, 30 + SIDE * y), (SIDE - 1, SIDE - 1), STRATA[name][0])
                for (x, y), name in pixels.items()
            ),
            *(dot((36.5 + SIDE * x, 36.5 + SIDE * y), radius=3.5) for x, y in chosen),
            label((400, 42), "stratum", anchor="start", bold=True),
            label((570, 42), "pixels", anchor="end", bold=True),
            label((680, 42), "probes", anchor="end", bold=True),
            *_rows(sizes, counts),
            dot((409, 172), radius=3.5),
            label((426, 177), "probe, chosen at random", anchor="start"),
            labels((400, 208), ("estimated sum of squared errors:",), anchor="start", size=14),
            labels((400, 230), ("each stratum's number of pixels times",), anchor="start", size=14),
            labels((400, 252), ("the mean of its probes",), anchor="start", size=14),
        ],
    )


def _rows(sizes: Counter[str], counts: Counter[str]) -> Iterator[str]:
    """A row of the table for each stratum."""
    for number, (name, (color, _)) in enumerate(STRATA.items()):
        y = 70 + 30 * number
        yield box((402, y - 12), (SIDE, SIDE), color)
        yield label((426, y), name, anchor="start")
        yield label((570, y), str(sizes[name]), anchor="end")
        yield label((680, y), str(counts[name]), anchor="end")


def _stratum(x: int, y: int) -> str:
    """What a pixel of a picture with a ball shows."""
    inside = {(x + i, y + j): _is_ball(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    if len(set(inside.values())) == 2:
        return BORDER
    return PILOT if inside[x, y] or (x % 4 == 0 and y % 4 == 0) else INTERPOLATED


def _is_ball(x: int, y: int) -> bool:
    return (x - 12) ** 2 + (y - 7) ** 2 < 22


def intervals() -> str:
    """Reported intervals and true errors of pictures of one scene, from the figures that are kept."""
    measured = figures.read("intervals")
    found = sorted(measured["pictures"], key=lambda one: one["true"])
    target = measured["target"]
    held = sum(_holds(one) for one in found)
    reached = sum(one["true"] <= target for one in found)
    high = 1.1 * max(one["high"] for one in found)

    def at(number: float, error: float) -> Place:
        return 64 + 640 * (number + 0.5) / len(found), 250 - 220 * error / high

    (left, level), (right, _) = at(-0.5, target), at(len(found) - 0.5, target)
    return picture(
        320,
        "Reported intervals and true errors",
        f"{len(found)} pictures of one scene with different seeds, sorted by their true error. {held} of the "
        f"reported intervals contain the true error, and {reached} true errors are at most the target.",
        [
            line(at(-0.5, 0), at(len(found) - 0.5, 0)),
            line((left, level), (right, level), INK, dashed=True),
            label((left - 8, level + 5), "target", anchor="end"),
            label((left - 8, 255), "0", anchor="end"),
            label((left - 8, 26), "error", anchor="end"),
            *(part for number, one in enumerate(found) for part in _interval(at, number, one)),
            label((left, 276), f"{len(found)} seeds, sorted by the true error", anchor="start", size=SMALL),
            line((64, 296), (64, 312), OPEN, width=5),
            label((74, 309), f"contains the true error: {held}", anchor="start"),
            line((312, 296), (312, 312), BLOCKED, width=2),
            label((322, 309), f"does not: {len(found) - held}", anchor="start"),
            diamond((434, 304), radius=4.5),
            label((446, 309), f"true error, up to the target: {reached}", anchor="start"),
        ],
    )


def _interval(at: Any, number: int, one: dict[str, float]) -> list[str]:
    """The interval of a picture and its true error."""
    color, width = (OPEN, 5) if _holds(one) else (BLOCKED, 2)
    ends = at(number, one["low"]), at(number, one["high"])
    return [line(*ends, color, width=width), diamond(at(number, one["true"]), radius=4.5)]


def _holds(one: dict[str, float]) -> bool:
    return one["low"] <= one["true"] <= one["high"]
