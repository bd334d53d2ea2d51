"""What an engine is asked to do, and what comes back. All of it travels between processes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from schemas.scene import Scene
from schemas.tiles import Pass, Tile
from service.store.tiles import StoredTile


# Two tasks are the same only if they are the same object: a tile that is tried again is a new task.
@dataclass(frozen=True, eq=False)
class TileTask:
    """Render a tile of a job in a pass, and keep the pixels in the store."""

    job: str
    spec_sha256: str
    tile: Tile
    pass_: Pass
    attempt: int


@dataclass(frozen=True, eq=False)
class ComposeTask:
    """Make the final picture of a job, and its layers, from its tiles."""

    job: str
    width: int
    height: int
    parts: tuple[StoredTile, ...]
    attempt: int
    layers: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class TraceTask:
    """Cast rays into a scene."""

    scene: Scene
    origins: NDArray[np.float64]
    directions: NDArray[np.float64]


JobTask = TileTask | ComposeTask
Task = JobTask | TraceTask


@dataclass(frozen=True)
class TileDone:
    """A tile lies in the store."""

    crc32: int
    counts: dict[str, int]
    cpu_seconds: float
    work: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class ComposeDone:
    """The final picture lies in the store; ``numerics`` counts its bad pixels by kind."""

    sha256: str
    numerics: dict[str, int]


@dataclass(frozen=True)
class TraceDone:
    """What the rays hit; arrays named as in ``renderer.trace``."""

    hits: dict[str, NDArray[Any]] = field(repr=False)


@dataclass(frozen=True)
class TaskFailed:
    """A task ended with an error of its own; a second try would end the same way.

    ``code`` is ``storage_full`` where the disk was full: only then is a second try worth it.
    """

    code: str
    message: str


@dataclass(frozen=True)
class WorkerDied:
    """The worker died while it ran the task; the task may be the reason."""


@dataclass(frozen=True)
class Interrupted:
    """The task was taken from its worker, or never began; nothing is known against it."""


Outcome = TileDone | ComposeDone | TraceDone | TaskFailed | WorkerDied | Interrupted


class Report(Protocol):
    """Receives the outcome of a task, once for each task, from any thread."""

    def __call__(self, task: Task, outcome: Outcome, /) -> None:
        """Take note and return at once."""
