"""Inside a worker process: how it starts, and how it executes a task."""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial, singledispatchmethod
from itertools import groupby
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

import renderer
from accuracy.inspection import inspect, inspection_plan
from accuracy.quotes import quote
from renderer import film, progressive
from renderer.adaptive.target_plan import target_plan
from renderer.images import files as image_files
from schemas.api.comparisons import ComparisonAnswer
from schemas.api.inspections import Inspection, TraceAnswer
from schemas.api.jobs import JobRequest
from schemas.api.plans import Quote
from schemas.api.previews import PREVIEW_QUALITY
from schemas.limits import Limits
from service import logs
from service.errors import (
    RefusedError,
    RequestDamagedError,
    StoreAwayError,
    StoreFullError,
    StoreReadOnlyError,
)
from service.storage.assets import AssetStore
from service.storage.checksums import LOSS_ERRORS
from service.storage.folder import ASSETS, JOBS, place_of
from service.storage.tiles import Layers, TileStore, damaged_steps
from service.workers import layers
from service.workers.comparing import compared
from service.workers.heartbeats import Lease, beat
from service.workers.kept_plans import KeptPlans
from service.workers.passes import PassWorker
from service.workers.planning import Outline, check_preview, compile_admitted, outline, read_again
from service.workers.tasks import (
    OUT_OF_MEMORY,
    REQUEST_DAMAGED,
    STORAGE_AWAY,
    STORAGE_FULL,
    STORAGE_READ_ONLY,
    AdvanceDone,
    AdvanceTask,
    CallDone,
    CallRefused,
    CallTask,
    CompareTask,
    ComposeDone,
    ComposeTask,
    InputDamaged,
    InspectTask,
    Interrupted,
    JobTask,
    Outcome,
    PlanTask,
    Preempted,
    PreviewTask,
    QuoteTask,
    SampleTask,
    Task,
    TaskFailed,
    TileDone,
    TileTask,
    TraceTask,
    log_names,
    memory_limit,
)

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

FAILURE_CODES: dict[type[Exception], str] = {
    RequestDamagedError: REQUEST_DAMAGED,
    StoreFullError: STORAGE_FULL,
    StoreReadOnlyError: STORAGE_READ_ONLY,
    StoreAwayError: STORAGE_AWAY,
}


@dataclass(frozen=True)
class WorkerSetup:
    """Settings that a worker process starts with; ``store`` is the address that `place_of` reads.

    ``workers`` are those that share the tiles of a pass.
    """

    store: str
    limits: Limits
    memory_bytes: int
    lease: Lease = field(default_factory=Lease)
    log_level: str = "info"
    workers: int = 1


class Worker:
    """Executes tasks one after another; keeps the plans of the last few jobs.

    Attributes
    ----------
    plans : KeptPlans
        Those plans.
    """

    def __init__(self, setup: WorkerSetup) -> None:
        place = place_of(setup.store)
        self._store = TileStore(place.within(JOBS))
        self._assets = AssetStore(place.within(ASSETS), setup.limits)
        self._passes = PassWorker(self._store, setup.workers, setup.lease.slice_seconds)
        self._slice_seconds = setup.lease.slice_seconds
        self.plans = KeptPlans(setup.memory_bytes)

    @singledispatchmethod
    def execute(self, task: Any) -> Outcome:
        """Execute a task and return its outcome."""
        raise TypeError(type(task).__name__)

    @execute.register
    def render(self, task: TileTask) -> TileDone | Preempted:
        """Render a tile of fixed quality, or as much as fits in a time slice."""
        begun = time.process_time()
        plan, kept = self._plan(task), self._unfinished(task) if task.resumed else None
        tile = renderer.TileRendering(plan, task.tile, task.pass_, kept)
        # Planning does not count towards the slice: it could take all of it each time.
        if not tile.run(time.monotonic() + self._slice_seconds):
            self._store.put_unfinished(task.job, task.tile, task.pass_, tile.arrays())
            return Preempted(time.process_time() - begun)
        result = tile.result()
        if result.layers:
            self._store.put_layers(task.job, task.tile, task.pass_, task.attempt, result.layers)
        crc32 = self._store.put_tile(task.job, task.tile, task.pass_, task.attempt, result.pixels)
        return TileDone(crc32, result.counts, time.process_time() - begun, result.work)

    @execute.register
    def sample(self, task: SampleTask) -> TileDone | Preempted | Interrupted:
        """Render a tile of target quality."""
        # Planning counts towards the time limit.
        until = inf if task.seconds_left is None else time.monotonic() + task.seconds_left
        begun = time.process_time()
        return self._passes.sample(target_plan(self._plan(task)), task, until, begun)

    @execute.register
    def advance(self, task: AdvanceTask) -> AdvanceDone:
        """Merge a pass of target quality."""
        return self._passes.advance(target_plan(self._plan(task)), task)

    @execute.register
    def compose(self, task: ComposeTask) -> ComposeDone:
        """Make the final picture of fixed quality."""
        image = np.empty((task.height, task.width, 3), np.float32)
        clamped = 0
        squares = []
        tiles = zip(task.parts, self._store.get_tiles(task.job, task.parts), strict=True)
        for _, group in groupby(tiles, key=lambda one: one[0].tile.index):
            parts = list(group)
            tile = parts[0][0].tile
            pixels = [(part.pass_, found) for part, found in parts]
            image[tile.y0 : tile.y1, tile.x0 : tile.x1] = film.compose(pixels)
            clamped += film.clamped(pixels)
            if task.compared:
                squares.append(progressive.squares_of(pixels))
        sheets = self._layers(task)
        sha256, checksums = layers.put_final(self._store, task.job, task.attempt, image, sheets)
        numerics = {"non_finite": film.non_finite(image), "clamped": clamped}
        errors = progressive.errors_of(squares, task.width * task.height)
        documents = {index: error.document() for index, error in errors.items()}
        return ComposeDone(sha256, numerics, documents, checksums)

    @execute.register
    def call(self, task: CallTask) -> CallDone | CallRefused:
        """Answer a call, and measure its cost."""
        begun = time.process_time()
        try:
            answer = self.answer(task)
        except RefusedError as error:
            return CallRefused(error.errors, error.more, time.process_time() - begun)
        return CallDone(answer, time.process_time() - begun)

    @singledispatchmethod
    def answer(self, task: Any) -> Any:
        """Return the answer to a call."""
        raise TypeError(type(task).__name__)

    @answer.register
    def plan(self, task: PlanTask) -> Outline:
        """Return the outline of a request's plan, before its files are read."""
        return outline(read_again(task.body), task.workers, task.tile_size)

    @answer.register
    def trace(self, task: TraceTask) -> bytes:
        """Return the hits of rays as JSON, whose encoding would block the server."""
        compile_admitted(JobRequest(scene=task.scene))
        plan = renderer.compile_scene(renderer.load_scene(task.scene, assets=self._assets))
        found = renderer.trace(plan, task.origins, task.directions)
        hits = {name: getattr(found, name).tolist() for name in TraceAnswer.model_fields}
        missed = [shape < 0 for shape in hits["shape"]]
        for name in ("t", "position", "normal", "uv"):
            hits[name] = [None if miss else value for value, miss in zip(hits[name], missed, strict=True)]
        return TraceAnswer.model_validate(hits).model_dump_json().encode()

    @answer.register
    def quote(self, task: QuoteTask) -> Quote:
        """Return the cost of a picture."""
        asked = task.request
        compile_admitted(JobRequest(scene=asked.scene, quality=asked.quality))
        return quote(
            renderer.load_scene(asked.scene, assets=self._assets),
            asked.quality,
            target_error=asked.target_error,
            seconds=asked.seconds,
            workers=task.workers,
        )

    @answer.register
    def preview(self, task: PreviewTask) -> bytes:
        """Return a small picture, as a PNG file."""
        check_preview(task.scene, task.workers)
        plan = renderer.compile_scene(renderer.load_scene(task.scene, assets=self._assets), PREVIEW_QUALITY)
        return image_files.encode_png(renderer.render(plan).image, task.scene.display)

    @answer.register
    def compare(self, task: CompareTask) -> ComparisonAnswer:
        """Return the differences of two pictures."""
        return compared(task, self._store, self._assets)

    @answer.register
    def inspect(self, task: InspectTask) -> Inspection:
        """Return the explanation of a pixel."""
        plan = self.plans.get(f"inspected {task.spec_sha256}", lambda: self._inspection_plan(task))
        return inspect(plan, task.x, task.y)

    def damage(self, task: JobTask) -> InputDamaged:
        """Find the stored files that a task could not read."""
        match task:
            case ComposeTask():
                steps = damaged_steps(task.parts, partial(self._store.get_tile, task.job))
                steps += layers.damaged(self._store, task.job, task.layers, task.parts)
                return InputDamaged(tuple(dict.fromkeys(steps)))
            case AdvanceTask():
                return self._passes.damage(task)
            case SampleTask(merged=merged):
                return InputDamaged(merged=merged > 0)
        return InputDamaged()

    def _unfinished(self, task: TileTask) -> Layers | None:
        return self._store.get_unfinished(task.job, task.tile, task.pass_)

    def _layers(self, task: ComposeTask) -> Layers:
        return layers.composed(self._store, task.job, (task.height, task.width), task.layers, task.parts)

    def _plan(self, task: TileTask | AdvanceTask) -> renderer.RenderPlan:
        return self.plans.get(task.spec_sha256, lambda: self._compiled(task))

    def _compiled(self, task: TileTask | AdvanceTask) -> renderer.RenderPlan:
        request, scene = self._spec(task)
        return renderer.compile_scene(scene, request.quality, layers=request.layers)

    def _inspection_plan(self, task: InspectTask) -> renderer.RenderPlan:
        request, scene = self._spec(task)
        return inspection_plan(scene, request.quality)

    def _spec(self, task: TileTask | AdvanceTask | InspectTask) -> tuple[JobRequest, renderer.LoadedScene]:
        content = self._store.get_spec(task.job, task.spec_sha256)
        # It was accepted before: no limit applies any more.
        request = JobRequest.model_validate(json.loads(content))
        return request, renderer.load_scene(request.scene, assets=self._assets)


def work(connection: Connection, pulse: Connection, setup: WorkerSetup) -> None:
    """Run a worker process: say that it has started, and then answer each task with its outcome.

    Beats go through ``pulse`` meanwhile.
    """
    _prepare(setup)
    beating = pulse, setup.lease.beat_seconds
    threading.Thread(target=beat, args=beating, name="heartbeat", daemon=True).start()
    worker = Worker(setup)
    with suppress(EOFError, OSError):  # the parent is gone
        connection.send(os.getpid())
        while True:
            connection.send(_outcome(worker, connection.recv(), setup))


def _prepare(setup: WorkerSetup) -> None:
    """Disable core files, limit the memory, and configure logs like the service's.

    Other forms of a traceback would show the values of variables.
    """
    logs.configure(setup.log_level)
    # The service's own, which may come from a file that is not on this machine.
    os.environ.update(setup.limits.variables())
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # macOS refuses a limit below what every process has mapped from its start.
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_AS, (setup.memory_bytes, setup.memory_bytes))


def _outcome(worker: Worker, task: Task, setup: WorkerSetup) -> Outcome:
    """Execute a task. Errors come back as outcomes: not every exception can travel."""
    with suppress(MemoryError):
        return _tried(worker, task)
    # Outside of the handler, whose traceback would keep the memory of the task alive.
    if worker.plans.drop():
        with suppress(MemoryError):
            return _tried(worker, task)
    return TaskFailed(OUT_OF_MEMORY, _too_large(setup))


def _tried(worker: Worker, task: Task) -> Outcome:
    try:
        return _executed(worker, task)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever a task raises is its outcome)
        return _failure(task, error)


def _executed(worker: Worker, task: Task) -> Outcome:
    """Execute a task, or find out which of the files that it reads are damaged."""
    try:
        return worker.execute(task)
    except LOSS_ERRORS:
        if not isinstance(task, JobTask):
            raise
        return worker.damage(task)


def _too_large(setup: WorkerSetup) -> str:
    return (
        f"Rendering needs more than the {memory_limit(setup.memory_bytes)}. "
        "Ask for a smaller picture, or make textures and meshes smaller."
    )


def _failure(task: Task, error: Exception) -> TaskFailed:
    for kind, code in FAILURE_CODES.items():
        if isinstance(error, kind):
            return TaskFailed(code, str(error))
    import structlog  # noqa: PLC0415 - workers start without it, and few ever log

    log = structlog.get_logger()
    log.error("task failed", task=type(task).__name__, exc_info=error, **log_names(task))
    if isinstance(error, renderer.SceneError):
        first = error.errors[0]
        return TaskFailed("scene_not_usable", f"/scene{first.pointer}: {first.detail}")
    if isinstance(error, renderer.RenderError):
        return TaskFailed("render_failed", str(error))
    return TaskFailed("render_failed", f"The renderer stopped with {type(error).__name__}.")
