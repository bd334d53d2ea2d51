"""A picture of target quality in the making: one pass after another, in whichever process renders them."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.forecast import (
    Forecast,
    Progress,
    forecast,
    kind_of,
    measured_prices,
    seconds_left,
    usual_prices,
)
from renderer.adaptive.guides import Surroundings, surroundings
from renderer.adaptive.partition import pass_tiles
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.samples import Samples
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import OutOfTimeError, TimeLimit, reserve
from renderer.errors import told
from renderer.film import BRIGHTEST, non_finite
from renderer.integrator import WORK
from renderer.layers import LayerBuffers
from renderer.plan.plan import RenderPlan
from renderer.results import RenderResult, TileEvent
from renderer.workers import shared_out
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile

Each = Callable[[list[TileRequest]], Iterator[tuple[TileRequest, Samples | None]]]
"""Renders what a pass asks for, in any order; None for what there was no time for."""


@dataclass(slots=True)
class AdaptiveRender:
    """A picture in the making: its passes, one after another, and what they took.

    Attributes
    ----------
    plan : RenderPlan
    tile_size : int or None
        Side of tiles, pixels; None for tiles that share out each pass evenly.
    on_tile : callable or None
        Called with each tile.
    deadline, begun : float
        By the clock of `time.monotonic`, seconds.
    estimate : Estimate
    workers : int
        Processes that share the tiles of a pass; 0 where nobody waits for a single tile.
    counts : Counter
        Rays by kind, and `execute.WORK`.
    cpu_seconds : float
        Of tiles, and of what is decided and merged between them.
    done : int
        Tiles.
    passes : list of dict
        What had been spent when each pass ended, and the error by then.
    buffers : LayerBuffers
        Layers of what the centres of pixels show.
    prices : dict
        CPU seconds of a ray by kind, as far as they were measured.
    progress : Progress
    between, between_cpu : float
        Seconds that deciding and merging has taken, and CPU seconds.
    """

    plan: RenderPlan
    tile_size: int | None
    on_tile: Callable[[TileEvent], None] | None
    deadline: float
    begun: float
    estimate: Estimate
    workers: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    cpu_seconds: float = 0.0
    done: int = 0
    passes: list[dict[str, Any]] = field(default_factory=list)
    buffers: LayerBuffers = field(init=False)
    prices: dict[str, float] = field(init=False)
    progress: Progress = field(init=False)
    between: float = 0.0
    between_cpu: float = 0.0

    def __post_init__(self) -> None:
        self.buffers = LayerBuffers(self.plan.layers, self.plan.height, self.plan.width)
        self.prices = usual_prices(self.plan)
        self.progress = Progress(self.deadline - self.begun)

    def step(self, each: Each) -> bool:
        """Render a pass; False if the picture is done or its time is over.

        The first, a coarse picture with all layers, is never cut short.
        """
        late = self._render(each)
        late = late or time.monotonic() >= self._last_moment()
        with self._counted():
            more = not late and self.estimate.advance()
            if late:
                self.estimate.settle()
        self._note()
        return more

    def _render(self, each: Each) -> bool:
        """Render the tiles of a pass; True if there was no time for all of them."""
        late = False
        with self._counted():
            kind, rays = kind_of(self.estimate), self.estimate.rays_wanted()
            expected = forecast(self.estimate, self.prices)
            requests = self.requests()
        seconds, traced = 0.0, 0
        for request, samples in each(requests):
            if samples is None:
                late = True
                continue
            traced += samples.counts["camera"]
            seconds += samples.cpu_seconds
            self._take(request.tile, samples, expected, traced / max(rays, 1))
        if not late:
            self.prices = measured_prices(self.prices, kind, rays, seconds, len(requests))
        return late

    def requests(self) -> list[TileRequest]:
        """The tiles of a pass in which something is wanted."""
        records = not self.passes and records_centres(self.plan)
        limit = self._limit()
        found = pass_tiles(self.estimate, self.prices, self.workers, self.tile_size, records=records)
        parts = [(tile, self.estimate.requested.part(tile)) for tile in found]
        return [TileRequest(tile, part, self._around(tile, part), records, limit) for tile, part in parts]

    def _around(self, tile: Tile, levels: LevelRequest) -> Surroundings | None:
        """Pilot samples around a tile, if it needs them."""
        estimate = self.estimate
        if not levels.needs_pilots(self.plan):
            return None
        return surroundings(tile, estimate.pilots, estimate.labels, estimate.colors)

    def _limit(self) -> TimeLimit | None:
        if not self.passes or self.deadline == np.inf:
            return None
        until = time.time() + self._last_moment() - time.monotonic()
        return TimeLimit(until, self.prices[kind_of(self.estimate)])

    def _last_moment(self) -> float:
        """When tiles have to end, so that the picture is there at the deadline."""
        stretch = max(self.between / self.between_cpu, 1.0) if self.between_cpu else 1.0
        return self.deadline - reserve(self.deadline - self.begun, self.estimate.have.size, stretch)

    def number(self) -> Pass:
        """The pass that runs."""
        return Pass(index=len(self.passes), stride=1, first=0, last=0)

    def _take(self, tile: Tile, samples: Samples, expected: Forecast, part: float) -> None:
        """Keep what was found in a tile, and show it."""
        with self._counted():
            self.estimate.take(tile, samples)
            self.buffers.take(tile, samples.layers)
        self.counts.update(samples.counts)
        self.counts.update(samples.work)
        self.cpu_seconds += samples.cpu_seconds + samples.layer_seconds
        self.done += 1
        if self.on_tile:
            self._report(tile, expected, part)

    def _report(self, tile: Tile, expected: Forecast, part: float) -> None:
        assert self.on_tile
        progress, elapsed = self.progress, time.monotonic() - self.begun
        progress.note(expected.share(self.cpu_seconds, part), self.done, elapsed)
        left = seconds_left(progress.share, elapsed, progress.limit)
        pixels = self.estimate.part(tile)
        self.on_tile(TileEvent(tile, self.number(), pixels, self.done, progress.total, progress.share, left))

    def _note(self) -> None:
        """Keep what the picture has taken when a pass ends, and its error, if that is known by then."""
        error = self.estimate.error
        rays = {name: count for name, count in self.counts.items() if name not in WORK}
        self.passes.append(
            {
                "seconds": time.monotonic() - self.begun,
                "cpu_seconds": self.cpu_seconds,
                "rays": rays,
                "error": None if error is None else error.document(),
            }
        )

    @contextmanager
    def _counted(self) -> Iterator[None]:
        """Count what this process does between tiles."""
        begun, begun_cpu = time.monotonic(), time.process_time()
        yield
        spent = time.process_time() - begun_cpu
        self.between += time.monotonic() - begun
        self.between_cpu += spent
        self.cpu_seconds += spent


def attempt(plan: RenderPlan, request: TileRequest) -> Samples | None:
    """Render what is asked of a tile, None if its time is over; errors name the tile."""
    with told(plan.seed, request.tile, f"levels up to {request.levels.want.max()}"):
        try:
            return render_request(plan, request)
        except OutOfTimeError:
            return None


def records_centres(plan: RenderPlan) -> bool:
    """Whether the first pass records what the centres of pixels show."""
    return any(layer.values for layer in plan.layers)


def render_adaptively(
    plan: RenderPlan,
    quality: TargetQuality,
    on_tile: Callable[[TileEvent], None] | None,
    workers: int | None,
    tile_size: int | None,
) -> RenderResult:
    """Render a whole picture of target quality; parameters as of `renderer.render`."""
    begun = time.monotonic()
    deadline = np.inf if quality.time_limit is None else begun + quality.time_limit
    alone = not on_tile and deadline == np.inf and (workers or 1) == 1
    estimate = Estimate.begin(plan)
    render = AdaptiveRender(plan, tile_size, on_tile, deadline, begun, estimate, 0 if alone else workers or 1)
    with shared_out(workers, partial(attempt, plan)) as each:
        while render.step(each):
            pass
    layers = render.buffers.finished() | estimate.layers(layer.name for layer in plan.layers)
    image = estimate.image()
    return RenderResult(image, layers, _report(render, image))


def _report(render: AdaptiveRender, image: Any) -> dict[str, Any]:
    plan, estimate = render.plan, render.estimate
    assert estimate.error is not None
    shaded = [lighting.emitter.count for lighting in plan.lightings]
    return {
        "seconds": time.monotonic() - render.begun,
        "cpu_seconds": render.cpu_seconds,
        "between_cpu_seconds": render.between_cpu,
        "width": plan.width,
        "height": plan.height,
        "rays": {name: count for name, count in render.counts.items() if name not in WORK},
        "work": {name: render.counts[name] for name in WORK},
        "samples": {
            "antialiasing_mean": float(estimate.counts().mean()),
            "light_mean": float(np.mean(shaded)) if shaded else 0.0,
        },
        "error": estimate.error.document(),
        "passes": render.passes,
        "numerics": {
            "non_finite": non_finite(image),
            "clamped": int(np.count_nonzero((image >= BRIGHTEST).any(axis=2))),
        }
        | plan.numerics,
        "plan": plan.describe().model_dump(mode="json"),
    }
