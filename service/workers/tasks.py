"""Tasks of an engine and their outcomes, as they are sent between processes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.forecast import Forecast
from schemas.api.comparisons import ComparisonRequest, Encoding
from schemas.api.plans import QuoteRequest
from schemas.errors import Problem
from schemas.scene import Scene
from schemas.tiles import Pass, Tile
from service.storage.checksums import Expected
from service.storage.tiles import Checksums, Step, StoredTile

STORAGE_FULL, STORAGE_READ_ONLY, STORAGE_AWAY = "storage_full", "storage_read_only", "storage_away"
OUT_OF_MEMORY, TOOK_TOO_LONG, REQUEST_DAMAGED = "out_of_memory", "took_too_long", "request_damaged"


# Two tasks are the same only if they are the same object: a tile that is tried again is a new task.
@dataclass(frozen=True, eq=False)
class TileTask:
    """Render a tile of a job in a pass, and keep the pixels in the store.

    Where it is ``resumed``, an earlier task was preempted, and what that had rendered is in the store.
    """

    job: str
    spec_sha256: str
    tile: Tile
    pass_: Pass
    attempt: int
    resumed: bool = field(default=False, kw_only=True)


@dataclass(frozen=True, eq=False)
class SampleTask(TileTask):
    """Bring the pixels of a tile to the levels of a pass, and store the samples.

    ``merged`` is the attempt that has merged the pass before and said what this one wants; 0 where there
    was none. ``checksums`` are those of its files, as far as they are known. What is not finished when the
    ``seconds_left`` are over is given up. They count from when the task was handed out: clocks of two
    machines are never compared. A camera ray is expected to take ``ray_seconds``.
    """

    merged: int
    seconds_left: float | None
    ray_seconds: float = 0.0
    checksums: Checksums = field(default_factory=dict, repr=False)


@dataclass(frozen=True, eq=False)
class AdvanceTask:
    """Merge the tiles of a pass into a picture of target quality, and plan the next pass.

    ``merged`` and ``checksums`` are as in `SampleTask`, ``recorded`` are the tiles that have recorded
    ``layers``. ``last`` says that no pass follows, whatever the error is: then not all tiles of the pass need
    be there. ``prices`` are CPU seconds of camera rays by kind, as measured before this pass; None before any
    was.
    """

    job: str
    spec_sha256: str
    pass_: Pass
    parts: tuple[StoredTile, ...]
    merged: int
    tile_size: int | None
    last: bool
    attempt: int
    layers: tuple[str, ...]
    recorded: tuple[StoredTile, ...]
    prices: dict[str, float] | None = None
    checksums: Checksums = field(default_factory=dict, repr=False)


@dataclass(frozen=True, eq=False)
class ComposeTask:
    """Assemble the final picture of a job, and its layers, from its tiles.

    ``compared`` says that their errors follow from the differences of its passes.
    """

    job: str
    width: int
    height: int
    parts: tuple[StoredTile, ...]
    attempt: int
    layers: tuple[str, ...] = ()
    compared: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class CallTask:
    """Answer a request of a ``user``, who waits for it."""

    user: str


@dataclass(frozen=True, eq=False)
class PlanTask(CallTask):
    """Plan the request of a job, of which ``body`` was checked; ``workers`` would render it."""

    body: bytes = field(repr=False)
    workers: int
    tile_size: int | None


@dataclass(frozen=True, eq=False)
class TraceTask(CallTask):
    """Cast rays into a scene."""

    scene: Scene
    origins: NDArray[np.float64]
    directions: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class QuoteTask(CallTask):
    """Measure the cost of a picture by a pilot; ``workers`` would render it."""

    request: QuoteRequest
    workers: int


@dataclass(frozen=True, eq=False)
class PreviewTask(CallTask):
    """Render a small picture of a scene; the price depends on the number of ``workers``."""

    scene: Scene
    workers: int


@dataclass(frozen=True)
class ComparedPicture:
    """A picture of a job, with these of its layers, or an asset, or the content of a file.

    It lies in the store under the name of its ``render``, in files whose names begin with ``prefix``; what is
    known of each is in ``expected``, and ``spec_sha256`` is the digest of its request.
    """

    job: str | None
    render: str
    content: bytes = field(repr=False)
    encoding: Encoding | None
    layers: tuple[str, ...]
    prefix: str = ""
    spec_sha256: str = ""
    expected: dict[str, Expected] = field(default_factory=dict, repr=False)
    asset: str | None = None


@dataclass(frozen=True, eq=False)
class CompareTask(CallTask):
    """Compare two pictures; ``request`` has the options."""

    request: ComparisonRequest
    image: ComparedPicture
    reference: ComparedPicture


@dataclass(frozen=True, eq=False)
class InspectTask(CallTask):
    """Explain a pixel of a job's picture."""

    job: str
    spec_sha256: str
    x: int
    y: int


JobTask = TileTask | AdvanceTask | ComposeTask
Task = JobTask | CallTask


def after(task: Task, seconds: float) -> Task:
    """Return a task with the time that is left after a wait, seconds."""
    if isinstance(task, SampleTask) and task.seconds_left is not None:
        return replace(task, seconds_left=task.seconds_left - seconds)
    return task


@dataclass(frozen=True)
class TileDone:
    """A tile is in the store."""

    crc32: int
    counts: dict[str, int]
    cpu_seconds: float
    work: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Preempted:
    """A tile is not finished at the end of its time slice.

    What was rendered by then is in the store; of a tile of target quality it is lost.
    """

    cpu_seconds: float


@dataclass(frozen=True)
class AdvanceDone:
    """A pass is merged: picture, state and demand are in the store.

    ``tiles`` are those in which the next pass has ``samples`` to take. ``expected`` predicts the CPU seconds
    of the passes to come, and ``ray_seconds`` those of a camera ray of the next one. Where none follows, the
    final picture lies in the store, and ``sha256`` is that of its file; ``numerics`` and ``checksums`` are as
    in `ComposeDone`. ``error`` is the estimate with its interval, once known. ``prices`` are as in
    `AdvanceTask`.
    """

    tiles: tuple[Tile, ...]
    samples: int
    expected: Forecast
    prices: dict[str, float]
    ray_seconds: float
    error: dict[str, float] | None
    numerics: dict[str, int]
    cpu_seconds: float
    sha256: str | None
    checksums: Checksums = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class ComposeDone:
    """The final picture is in the store; ``numerics`` counts its bad pixels by kind.

    ``errors`` are those after the passes of which they are known, by the pass's index, and ``checksums``
    those of all files that were written.
    """

    sha256: str
    numerics: dict[str, int]
    errors: dict[int, dict[str, float]] = field(default_factory=dict)
    checksums: Checksums = field(default_factory=dict, repr=False)


@dataclass(frozen=True, eq=False)
class CallDone:
    """The ``answer`` to a call, of a type that depends on the task. The worker took ``cpu_seconds``."""

    answer: Any = field(repr=False)
    cpu_seconds: float


@dataclass(frozen=True)
class CallRefused:
    """The request of a call cannot be used; pointers lead into the request."""

    problems: tuple[Problem, ...]
    more: int
    cpu_seconds: float


@dataclass(frozen=True)
class TaskFailed:
    """A task ended with an error of its own."""

    code: str
    message: str

    @property
    def passes(self) -> bool:
        """Whether the error is temporary; otherwise a second try would fail the same way."""
        return self.code in (STORAGE_FULL, STORAGE_READ_ONLY, STORAGE_AWAY)


@dataclass(frozen=True)
class InputDamaged:
    """Stored files that the task reads are damaged or missing.

    They are those of ``steps``, or what merging the pass before has left, where ``merged`` says so. There are
    none where a second read was good.
    """

    steps: tuple[Step, ...] = ()
    merged: bool = False


@dataclass(frozen=True)
class WorkerDied:
    """The worker died while it ran the task; the task may be the reason."""


@dataclass(frozen=True)
class Interrupted:
    """The task was taken from its worker, or never began, through no fault of its own.

    ``late`` says that the time of its job was spent, so that its result is not needed any more.
    """

    late: bool = False


@dataclass(frozen=True)
class Released:
    """The task was held back for a while, and may be handed out again."""


def log_names(task: Task | None) -> dict[str, str | int]:
    """Name a task in a log: its job, tile, pass and attempt, as far as it has them."""
    names: dict[str, str | int] = {}
    if isinstance(task, JobTask):
        names |= {"job": task.job, "attempt": task.attempt}
    if isinstance(task, TileTask | AdvanceTask):
        names["pass_index"] = task.pass_.index
    if isinstance(task, TileTask):
        names["tile"] = task.tile.index
    return names


def memory_limit(worker_bytes: int) -> str:
    """Describe the memory limit of a worker and its setting, within a sentence.

    >>> memory_limit(4 << 30)
    "4 GiB of memory that a worker may use (setting 'worker_memory_bytes')"
    """
    return (
        f"{worker_bytes / (1 << 30):.3g} GiB of memory that a worker may use (setting 'worker_memory_bytes')"
    )


Outcome = (
    TileDone
    | Preempted
    | AdvanceDone
    | ComposeDone
    | CallDone
    | CallRefused
    | TaskFailed
    | InputDamaged
    | WorkerDied
    | Interrupted
    | Released
)


class Report(Protocol):
    """Receives the outcome of a task, once for each task, from any thread."""

    def __call__(self, task: Task, outcome: Outcome, /) -> None:
        """Record it and return at once."""


class Cause(StrEnum):
    """Why a task is tried again."""

    WORKER_DIED = "worker_died"
    INTERRUPTED = "interrupted"
    STORAGE_FULL = STORAGE_FULL
    STORAGE_READ_ONLY = STORAGE_READ_ONLY
    STORAGE_AWAY = STORAGE_AWAY
    STORAGE_DAMAGED = "storage_damaged"
    SERVER_LOST = "server_lost"
    DATABASE_LOST = "database_lost"


def cause_of(outcome: Outcome) -> Cause | None:
    """Return why a task is tried again; None if only its time was up, or if it was counted as it was held.

    Raises
    ------
    ValueError
        If the outcome is not one after which a task is tried again.
    """
    match outcome:
        case WorkerDied():
            return Cause.WORKER_DIED
        case Interrupted(late=late):
            return None if late else Cause.INTERRUPTED
        case Released():
            return None
        case TaskFailed(code=code):
            return Cause(code)
        case InputDamaged():
            return Cause.STORAGE_DAMAGED
        case _:
            raise ValueError(outcome)


WHOLE_PICTURE = 0
"""Tile number of the whole picture."""


def pass_of(index: int) -> Pass:
    """Make a pass. How many samples it takes differs from pixel to pixel; in the first one they begin."""
    return Pass(index=index, stride=1, first=min(index, 1), last=1)


def numbered(tiles: Iterable[Tile]) -> list[Tile]:
    """Give the tiles of a pass the numbers that they have here."""
    return [replace(tile, index=number) for number, tile in enumerate(tiles, WHOLE_PICTURE + 1)]
