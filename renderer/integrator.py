"""The integrator: one loop over the stages of a plan, without effect-specific code."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np

from renderer.interaction import Points, Rays, points_of
from renderer.layers import Layers, record
from renderer.lights.emitters import PIXEL_DIMENSIONS
from renderer.math.arrays import Floats, Integers, put
from renderer.math.streams import keys
from renderer.plan.plan import RenderPlan
from renderer.samplers import PATTERNS
from renderer.tiling import Block
from renderer.waves import WaitingWaves, Wave, camera_wave, ordered
from renderer.workspace import FEWEST_POINTS, PAIRS_AT_ONCE, Workspace
from schemas.tiles import Pass, Tile

Light = Callable[[Points, Workspace], int]
"""One light's work on a chunk of points; gives the number of shadow rays."""

WORK_COUNTERS = ("shading_points", "texture_lookups")
"""Counters beside those of rays."""

_local = threading.local()


class OutOfTimeError(Exception):
    """The time ran out before the requested work was rendered."""


def render_layers(plan: RenderPlan, tile: Tile) -> tuple[Layers, dict[str, int]]:
    """Fill the layers of a tile that show the centres of its pixels, and count the work."""
    counts: Counter[str] = Counter()
    return record(plan.layers, tile, partial(centre_points, plan, counts)), dict(counts)


def camera_rays(plan: RenderPlan, block: Block, pass_: Pass, part: slice = slice(None)) -> Rays:
    """Rays through a block, those of one pixel together, in the order of their sample numbers.

    Only those in `part` are returned.
    """
    count = pass_.last - pass_.first
    columns, rows = block.columns.repeat(count)[part], block.rows.repeat(count)[part]
    samples = np.tile(np.arange(pass_.first, pass_.last, dtype=np.int64), block.columns.size)[part]
    key = keys(plan.seed, PIXEL_DIMENSIONS, plan.camera.numbers(columns, rows))
    place = PATTERNS[plan.antialiasing.pattern](key, samples, plan.antialiasing.samples)
    return rays_through(plan, columns, rows, samples, place)


def rays_through(
    plan: RenderPlan, columns: Integers, rows: Integers, samples: Integers, place: tuple[Floats, Floats]
) -> Rays:
    """Rays of samples (n,) through pixels (n,), at two coordinates (n,) within them."""
    pixels = plan.camera.numbers(columns, rows)
    origins, directions = plan.camera.rays(columns + place[0], rows + place[1], pixels, samples)
    bounds = plan.camera.bounds(columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    return Rays(origins, directions, pixels, samples, screen=bounds)


def centre_points(plan: RenderPlan, counts: Counter[str], block: Block) -> Points:
    """The points that the rays through the centres of a block's pixels hit."""
    x, y = (index.astype(np.float64) + 0.5 for index in (block.columns, block.rows))
    rays = Rays(
        origins=plan.camera.position,
        directions=plan.camera.directions(x, y),
        pixels=plan.camera.numbers(block.columns, block.rows),
        samples=np.zeros_like(block.columns),
        screen=plan.camera.bounds(*block.bounds),
    )
    counts["layers"] += rays.t.size
    points = intersect(plan, rays, lights=False)
    _count(points, counts)
    return points


@dataclass(frozen=True, slots=True, eq=False)
class FirstHits:
    """Albedo and expected error at the first hits of N camera rays.

    Attributes
    ----------
    colors : (3, N) float64
        Of textures, 1 without one.
    shading_error : (N,) float64
        As in `interaction.Points`.
    """

    colors: Floats
    shading_error: Floats

    @classmethod
    def none(cls, count: int) -> "FirstHits":
        """Defaults for rays that have not been traced."""
        return cls(np.ones((3, count)), np.zeros(count))

    def take(self, points: Points) -> None:
        """Keep the colours and errors of points."""
        put(self.colors, points.rays, points.colors)
        self.shading_error[points.rays] = points.shading_error


def radiance(
    plan: RenderPlan,
    rays: Rays,
    counts: Counter[str],
    first_hits: FirstHits | None = None,
    *,
    until: float = inf,
) -> Floats:
    """Radiance (3, N) along camera rays (N,), over all bounces.

    `first_hits` receives the albedo and expected error at the camera rays' own hits. Each depth has a sum of
    its own, to which a camera ray's paths add in their own order.

    Raises
    ------
    OutOfTimeError
        If a wave of rays is left at the time `until` of `time.monotonic`.
    """
    seen, points = local_radiance(plan, rays, counts)
    counts["camera"] += rays.t.size
    if first_hits is not None:
        first_hits.take(points)
    sums = [seen]
    waiting = WaitingWaves(successors(plan, points, camera_wave(rays)))
    while waiting:
        if time.monotonic() >= until:
            raise OutOfTimeError
        wave = waiting.next()
        seen, points = local_radiance(plan, wave.rays, counts)
        if wave.depth == len(sums):
            sums.append(np.zeros((3, rays.t.size)))
        for row, values in zip(sums[wave.depth], wave.weights * seen, strict=True):
            np.add.at(row, wave.targets, values)
        wave.count(counts)
        waiting.add(successors(plan, points, wave))
    return sum(sums[1:], sums[0])


def successors(plan: RenderPlan, points: Points, wave: Wave) -> list[Wave]:
    """Rays that leave the points that a wave has hit."""
    return ordered([each for stage in plan.scattering for each in stage.run(points, wave)], plan.seed)


def local_radiance(plan: RenderPlan, rays: Rays, counts: Counter[str]) -> tuple[Floats, Points]:
    """Radiance (3, N) at the hits of rays, without that of further rays; and the points hit."""
    points = intersect(plan, rays)
    result = plan.unshaded.radiance(rays.shapes)
    _count(points, counts)
    counts["shadow"] += shade(plan, points, [lighting.run for lighting in plan.lightings])
    put(result, points.rays, points.radiance)
    return result, points


def find_hits(plan: RenderPlan, rays: Rays, *, lights: bool = True) -> None:
    """Record the first hit of each ray: a shape, or with `lights` a light that the camera sees."""
    for stage in (*plan.intersectors, *(plan.visible_lights if lights else ())):
        stage.run(rays)


def intersect(plan: RenderPlan, rays: Rays, *, lights: bool = True) -> Points:
    """Find what rays hit, as `find_hits` does, and the points where that is a shape, ready for light."""
    find_hits(plan, rays, lights=lights)
    points = points_of(rays, plan.materials, bent=plan.bent)
    for stage in plan.surfaces:
        stage.run(points)
    return points


def shade(plan: RenderPlan, points: Points, lights: Sequence[Light]) -> int:
    """Add the light of points in chunks of about `PAIRS_AT_ONCE` pairs; return the number of shadow rays."""
    rays, step = 0, max(FEWEST_POINTS, PAIRS_AT_ONCE // plan.light_points)
    for start in range(0, points.count, step):
        chunk = points.between(start, min(start + step, points.count))
        for light in lights:
            rays += light(chunk, workspace())
    return rays


def _count(points: Points, counts: Counter[str]) -> None:
    counts["shading_points"] += points.count
    counts["texture_lookups"] += points.lookups


def workspace() -> Workspace:
    """Buffers of this thread."""
    if not hasattr(_local, "workspace"):
        _local.workspace = Workspace()
    return _local.workspace
