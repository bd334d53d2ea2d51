"""Render a picture of target quality by processes of this machine, one pass after another."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from renderer.adaptive.driver import Driver
from renderer.adaptive.error_statistics import sample_layers
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.forecast import UNKNOWN, Forecast, Progress, limited
from renderer.adaptive.requests import Samples, TileRequest
from renderer.adaptive.target_plan import target_plan
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import LAST_SECONDS, TimeLimit, reserve
from renderer.errors import tile_errors
from renderer.film import BRIGHTEST
from renderer.integrator import OutOfTimeError
from renderer.layers import LayerBuffers
from renderer.passes import Tally, run_pass
from renderer.plan.plan import RenderPlan
from renderer.results import RenderResult, TileEvent
from renderer.workers import shared_out
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile


@dataclass(slots=True)
class AdaptiveRender:
    """A render of target quality in progress. Satisfies `passes.Picture`.

    Attributes
    ----------
    driver : Driver
        Decides about each pass.
    on_tile : callable or None
        Called with each tile.
    deadline : float
        By `time.monotonic`, seconds.
    tally : Tally
        CPU seconds of tiles, and of merging and deciding between them.
    done : int
        Tiles.
    buffers : LayerBuffers
        Layers recorded at the centres of pixels.
    progress : Progress
    between, between_cpu : float
        Seconds and CPU seconds of merging and deciding.
    """

    driver: Driver
    on_tile: Callable[[TileEvent], None] | None = None
    deadline: float = np.inf
    tally: Tally = field(default_factory=Tally)
    done: int = 0
    buffers: LayerBuffers = field(init=False)
    progress: Progress = field(init=False)
    between: float = 0.0
    between_cpu: float = 0.0
    _late: bool = field(default=False, init=False)
    _rays: int = field(default=0, init=False)
    _traced: int = field(default=0, init=False)
    _expected: Forecast = field(default=UNKNOWN, init=False)

    def __post_init__(self) -> None:
        self.buffers = LayerBuffers(self.plan.layers, self.plan.height, self.plan.width)
        self.progress = Progress(self.deadline - self.tally.begun)

    @property
    def estimate(self) -> Estimate:
        """The picture so far."""
        return self.driver.estimate

    @property
    def plan(self) -> RenderPlan:
        """Plan of the picture."""
        return self.estimate.plan

    def tasks(self) -> list[TileRequest]:
        """Requests of the next pass."""
        limit = TimeLimit(self._last_moment(), self.driver.ray_seconds)
        with self._counted():
            requests = self.driver.requests(limit)
            self._expected = self.driver.forecast(self.between_cpu / max(len(self.tally.passes), 1))
            self._rays = self.estimate.rays_wanted()
        self._late, self._traced = False, 0
        return requests

    def _last_moment(self) -> float:
        """Deadline of tiles, so that the picture is finished at its own."""
        # A CPU second takes longer where other programs share the processors.
        stretch = max(self.between / self.between_cpu, 1.0) if self.between_cpu else 1.0
        last = LAST_SECONDS * self.estimate.have.size * stretch
        return self.deadline - reserve(self.deadline - self.tally.begun, last)

    def take(self, task: TileRequest, result: Samples | None) -> None:
        """Merge the samples of a tile and report it; None if it ran out of time."""
        if result is None:
            self._late = True
            return
        with self._counted():
            self.driver.take(task.tile, result)
            self.buffers.take(task.tile, result.layers)
        self.tally.count(result.counts, result.work, result.cpu_seconds + result.layer_seconds)
        self._traced += result.counts["camera"]
        self.done += 1
        if self.on_tile:
            self._report(task.tile, self.on_tile)

    def _report(self, tile: Tile, on_tile: Callable[[TileEvent], None]) -> None:
        progress, elapsed, spent = self.progress, self.tally.seconds, self.tally.cpu_seconds
        part = self._traced / self._rays
        progress.note(self._expected.share(spent, part), self.done, elapsed)
        left = limited(self._expected.seconds_left(spent, part, elapsed), elapsed, progress.limit)
        pass_ = Pass(index=len(self.tally.passes), stride=1, first=0, last=0)
        on_tile(
            TileEvent(tile, pass_, self.estimate.part(tile), self.done, progress.total, progress.share, left)
        )

    def end_pass(self) -> bool:
        """End the pass; False if the picture is done or its time is up."""
        late = self._late or time.monotonic() >= self._last_moment()
        with self._counted():
            more = self.driver.end_pass(last=late)
        error = self.estimate.error
        self.tally.end_pass(None if error is None else error.document())
        return more

    @contextmanager
    def _counted(self) -> Iterator[None]:
        """Count the time of this process between tiles."""
        begun, begun_cpu = time.monotonic(), time.process_time()
        yield
        spent = time.process_time() - begun_cpu
        self.between += time.monotonic() - begun
        self.between_cpu += spent
        self.tally.cpu_seconds += spent


def attempt(plan: RenderPlan, request: TileRequest) -> Samples | None:
    """Render a request, None if its time is up; errors name the tile."""
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
    tally = Tally()
    deadline = np.inf if quality.time_limit is None else tally.begun + quality.time_limit
    alone = not on_tile and deadline == np.inf and (workers or 1) == 1
    driver = Driver.begin(plan, 0 if alone else workers or 1, tile_size)
    picture = AdaptiveRender(driver, on_tile, deadline, tally)
    with shared_out(workers, partial(attempt, plan), start_after) as transport:
        while run_pass(picture, transport):
            pass
    estimate = driver.estimate
    layers = picture.buffers.finished() | sample_layers(estimate, (layer.name for layer in plan.layers))
    image = estimate.image()
    clamped = int(np.count_nonzero((image >= BRIGHTEST).any(axis=2)))
    report = tally.report(plan, image, float(estimate.counts().mean()), clamped)
    report["between_cpu_seconds"] = picture.between_cpu
    return RenderResult(image, layers, report, plan.document.display)
