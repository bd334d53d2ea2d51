"""How the cost grows: CPU seconds over pixels, light points and triangles, wall seconds over workers."""

from __future__ import annotations

import json
import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict

import renderer
from accuracy.variations import fixed_quality
from benchmarks import meshes
from benchmarks.machine import Spread, cpu_seconds, spread
from benchmarks.references import SCENES
from scenes.make_meshes import ply
from schemas.quality import FixedQuality, TargetQuality

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from schemas.quality import Quality

SIDES = (64, 128, 256, 512, 1024)
"""Pixels along either side."""

LIGHT_POINTS = (1, 4, 16, 64, 256)
TRIANGLES = (1_000, 10_000, 100_000)
"""About; `meshes` goes farther."""

SIDE = 128
"""Of the pictures whose light points grow."""

SHARED_SIDE = 512
"""Of the pictures that workers share: smaller ones of target quality are mostly the start of the workers."""

LONG = 4.0
"""CPU seconds after which a picture is not rendered once more: what takes long varies little."""

ROUNDS = 3
"""With one worker and with two, at most."""

TARGET = TargetQuality(mode="target", error=1 / 255)


def fixed(samples: int, light_points: int) -> FixedQuality:
    """So many camera samples a pixel, with so many points on each light."""
    return fixed_quality("sobol", samples, "sobol", light_points)


PICTURES: tuple[tuple[str, Quality], ...] = (("soft", fixed(16, 16)), ("soft", TARGET), ("chess", TARGET))


class Point(TypedDict):
    """A picture: what grows, how large it is, and CPU seconds in one process.

    `power` is that of `size` like which they have grown since the picture before, None in the first one.
    """

    over: str
    picture: str
    size: int
    cpu_seconds: Spread
    power: float | None


class Shared(TypedDict):
    """Wall seconds of a picture with one worker process and with two, their start included.

    `ratio` is that of the medians, 2 if nothing was lost.
    """

    picture: str
    one: Spread
    two: Spread
    ratio: float


class Scaling(TypedDict):
    """All curves."""

    points: list[Point]
    workers: list[Shared]


def measure(runs: int) -> Scaling:
    """Render each picture `runs` times, long ones less often, after the smallest of its curve.

    Target quality decides about light points by itself, so they grow with fixed quality alone.
    """
    points: list[Point] = []
    for scene, quality in PICTURES:
        plans = ((side * side, plan_of(scene, quality, side)) for side in SIDES)
        points += curve("pixels", name_of(scene, quality), plans, runs)
    lit = ((count, plan_of("soft", fixed(16, count), SIDE)) for count in LIGHT_POINTS)
    points += curve("light points", "soft, 16 samples", lit, runs)
    for quality in (fixed(1, 16), TARGET):
        points += curve("triangles", name_of("ball", quality), _balls(quality), runs)
    return Scaling(points=points, workers=[shared(*picture, SHARED_SIDE, runs) for picture in PICTURES])


def name_of(scene: str, quality: Quality) -> str:
    """A scene and its quality in words."""
    if isinstance(quality, TargetQuality):
        return f"{scene}, error {quality.error * 255:g}/255"
    assert quality.antialiasing is not None
    assert quality.light is not None
    return f"{scene}, {quality.antialiasing.samples} x {quality.light.samples}"


def plan_of(scene: str, quality: Quality, side: int) -> renderer.RenderPlan:
    """Compile a study scene whose picture has `side` pixels along its longer side."""
    document = json.loads((SCENES / f"{scene}.json").read_text(encoding="utf-8"))
    return renderer.compile_scene(small(document, side), quality)


def small(document: dict[str, Any], side: int) -> dict[str, Any]:
    """A scene document whose picture has `side` pixels along its longer side."""
    camera = document["camera"]
    scale = side / max(camera["width"], camera["height"])
    sizes = {name: round(camera[name] * scale) for name in ("width", "height")}
    return {**document, "camera": {**camera, **sizes}}


def _balls(quality: Quality) -> Iterator[tuple[int, renderer.RenderPlan]]:
    shape = {"type": "mesh", "asset": "ball", "smooth": True, "material": "plain"}
    for count in TRIANGLES:
        vertices, triangles = meshes.ball(count)
        yield len(triangles), meshes.plan_of(shape, {"ball": ply(vertices, triangles)}, quality)


def curve(
    over: str, picture: str, plans: Iterable[tuple[int, renderer.RenderPlan]], runs: int
) -> Iterator[Point]:
    """Time plans of growing size; the first is rendered once more before, as it warms caches up."""
    before: tuple[int, float] | None = None
    for size, plan in plans:
        if before is None:
            renderer.render(plan)
        seconds = spread(repeated(partial(_seconds, plan, cpu_seconds), runs))
        power = None if before is None else round(_power(before, (size, seconds["median"])), 2)
        yield Point(over=over, picture=picture, size=size, cpu_seconds=seconds, power=power)
        before = size, seconds["median"]


def _power(before: tuple[int, float], now: tuple[int, float]) -> float:
    """Like which seconds have grown with the size."""
    return math.log(now[1] / before[1]) / math.log(now[0] / before[0])


def repeated(timed: Callable[[], float], runs: int) -> list[float]:
    """Seconds of so many runs, of fewer where they take `LONG` in all.

    Examples
    --------
    >>> repeated(lambda: 1.5, 5)
    [1.5, 1.5, 1.5]
    """
    found = [timed()]
    while len(found) < runs and sum(found) < LONG:
        found.append(timed())
    return found


def shared(scene: str, quality: Quality, side: int, runs: int) -> Shared:
    """Time a picture with one worker and with two in turn: a machine that slows down slows both.

    Raises
    ------
    RuntimeError
        If the pictures are not the same to the byte.
    """
    plan = plan_of(scene, quality, side)
    if len({renderer.render(plan, workers=workers).image.tobytes() for workers in (1, 2)}) > 1:
        raise RuntimeError(f"{name_of(scene, quality)}: two workers give another picture than one.")
    rounds = [
        [_seconds(plan, time.perf_counter, workers) for workers in (1, 2)] for _ in range(min(runs, ROUNDS))
    ]
    one, two = (spread(seconds) for seconds in zip(*rounds, strict=True))
    ratio = round(one["median"] / two["median"], 2)
    return Shared(picture=name_of(scene, quality), one=one, two=two, ratio=ratio)


def _seconds(plan: renderer.RenderPlan, clock: Callable[[], float], workers: int | None = None) -> float:
    begun = clock()
    renderer.render(plan, workers=workers)
    return clock() - begun
