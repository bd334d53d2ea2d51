"""A picture of target quality rendered by processes of this machine, one pass after another."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.findings import sample_layers
from renderer.adaptive.forecast import Forecast, Progress, seconds_left
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.samples import Samples
from renderer.adaptive.target_plan import target_plan
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import LAST_SECONDS, OutOfTimeError, TimeLimit, reserve
from renderer.errors import tile_errors
from renderer.film import BRIGHTEST, non_finite
from renderer.integrator import WORK
from renderer.layers import LayerBuffers
from renderer.plan.plan import RenderPlan
from renderer.results import RenderResult, TileEvent
from renderer.workers import shared_out
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile

Transport = Callable[[list[TileRequest]], Iterator[tuple[TileRequest, Samples | None]]]
"""Renders the requests of a pass somewhere, and gives the samples in any order; None where there was no
time."""


@dataclass(slots=True)
class AdaptiveRender:
    """A render in progress: its passes, one after another, and what they took.

    Attributes
    ----------
    driver : Driver
        Decides what each pass does.
    on_tile : callable or None
        Called with each tile.
    deadline, begun : float
        By the clock of `time.monotonic`, seconds.
    counts : Counter
        Rays by kind, and `integrator.WORK`.
    cpu_seconds : float
        Of tiles, and of what is decided and merged between them.
    done : int
        Tiles.
    passes : list of dict
        What had been spent when each pass ended, and the error by then.
    buffers : LayerBuffers
        Layers of what the centres of pixels show.
    progress : Progress
    between, between_cpu : float
        Seconds that deciding and merging has taken, and CPU seconds.
    """

    driver: Driver
    on_tile: Callable[[TileEvent], None] | None = None
    deadline: float = np.inf
    begun: float = field(default_factory=time.monotonic)
    counts: Counter[str] = field(default_factory=Counter)
    cpu_seconds: float = 0.0
    done: int = 0
    passes: list[dict[str, Any]] = field(default_factory=list)
    buffers: LayerBuffers = field(init=False)
    progress: Progress = field(init=False)
    between: float = 0.0
    between_cpu: float = 0.0

    def __post_init__(self) -> None:
        self.buffers = LayerBuffers(self.plan.layers, self.plan.height, self.plan.width)
        self.progress = Progress(self.deadline - self.begun)

    @property
    def estimate(self) -> Estimate:
        """What is known of the picture."""
        return self.driver.estimate

    @property
    def plan(self) -> RenderPlan:
        """Of the picture."""
        return self.estimate.plan

    def step(self, transport: Transport) -> bool:
        """Render a pass; False if the picture is done or its time is over."""
        late = self._render(transport) or time.monotonic() >= self._last_moment()
        with self._counted():
            more = self.driver.end_pass(last=late)
        self._note()
        return more

    def _render(self, transport: Transport) -> bool:
        """Render the tiles of a pass; True if there was no time for all of them."""
        with self._counted():
            requests, expected = self.driver.requests(self._limit()), self.driver.forecast()
            rays = self.estimate.rays_wanted()
        late, traced = False, 0
        for request, samples in transport(requests):
            if samples is None:
                late = True
                continue
            traced += samples.counts["camera"]
            self._take(request.tile, samples, expected, traced / max(rays, 1))
        return late

    def _limit(self) -> TimeLimit | None:
        if self.deadline == np.inf:
            return None
        return TimeLimit(self._last_moment(), self.driver.ray_seconds)

    def _last_moment(self) -> float:
        """When tiles have to end, so that the picture is finished at the deadline."""
        # A CPU second lasts longer where other programs have the processors, too.
        stretch = max(self.between / self.between_cpu, 1.0) if self.between_cpu else 1.0
        last = LAST_SECONDS * self.estimate.have.size * stretch
        return self.deadline - reserve(self.deadline - self.begun, last)

    def number(self) -> Pass:
        """The pass that runs."""
        return Pass(index=len(self.passes), stride=1, first=0, last=0)

    def _take(self, tile: Tile, samples: Samples, expected: Forecast, part: float) -> None:
        """Keep what was found in a tile, and show it."""
        with self._counted():
            self.driver.take(tile, samples)
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
    """Render what is requested of a tile, None if its time is over; errors name the tile."""
    with tile_errors(plan.seed, request.tile, f"levels up to {request.levels.want.max()}"):
        try:
            return render_request(target_plan(plan), request)
        except OutOfTimeError:
            return None


def render_adaptively(
    plan: RenderPlan,
    quality: TargetQuality,
    on_tile: Callable[[TileEvent], None] | None,
    workers: int | None,
    tile_size: int | None,
    start_after: float = 0.0,
) -> RenderResult:
    """Render a whole picture of target quality; parameters as of `render` and `workers.shared_out`."""
    begun = time.monotonic()
    deadline = np.inf if quality.time_limit is None else begun + quality.time_limit
    alone = not on_tile and deadline == np.inf and (workers or 1) == 1
    driver = Driver.begin(plan, 0 if alone else workers or 1, tile_size)
    render = AdaptiveRender(driver, on_tile, deadline, begun)
    with shared_out(workers, partial(attempt, plan), start_after) as transport:
        while render.step(transport):
            pass
    layers = render.buffers.finished() | sample_layers(render.estimate, (layer.name for layer in plan.layers))
    image = render.estimate.image()
    return RenderResult(image, layers, _report(render, image), plan.document.display)


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
