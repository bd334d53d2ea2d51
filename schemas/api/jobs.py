"""Jobs: requests, states, tile events and logs.

Requests are closed and strict like the scene language. Answers are open: a client of this version reads
the answers of later ones and ignores unknown fields.
"""

from __future__ import annotations

import re
from datetime import datetime
from enum import StrEnum
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from schemas.api.layers import LayerNames
from schemas.base import Closed, Message
from schemas.errors import Problem
from schemas.quality import FixedQuality, Quality, TargetQuality
from schemas.quantities import WHOLE
from schemas.scene import Scene

LABEL_NAME = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,62}"
"""Regular expression of label names."""
LABEL_NAMES = (
    "A label's name has 1 to 63 characters: ASCII letters, digits, '_', '.' and '-', with a letter or digit "
    "first."
)


def _label_name(name: str) -> str:
    if not re.fullmatch(LABEL_NAME, name):
        raise PydanticCustomError("label_name", LABEL_NAMES)
    return name


LabelName = Annotated[
    str, Field(strict=True, json_schema_extra={"pattern": f"^{LABEL_NAME}$"}), AfterValidator(_label_name)
]
LabelValue = Annotated[str, Field(strict=True, max_length=200)]


class JobRequest(Closed):
    """The body of ``POST /v1/jobs`` and ``POST /v1/plans``."""

    scene: Scene = Field(description="The scene to render.")
    quality: Quality | None = Field(default=None, description="Overrides the scene's `sampling`.")
    layers: LayerNames = Field(
        default=(), description="What to store of each pixel beside its colour; each layer is a picture."
    )
    priority: Annotated[int, Field(strict=True, ge=-10, le=10), WHOLE] = Field(
        default=0, description="Your jobs with a higher priority run first. It does not affect other users."
    )
    labels: Annotated[dict[LabelName, LabelValue], Field(max_length=16)] = Field(
        default_factory=dict,
        description="At most 16 names with values, to find the job by. A name has 1 to 63 characters: "
        "ASCII letters, digits, `_`, `.` and `-`, with a letter or digit first. A value has at most 200.",
    )
    time_limit: Annotated[float, Field(strict=True, gt=0, le=86400)] | None = Field(
        default=None,
        description="Seconds after its start when an unfinished job ends. With target quality it succeeds "
        "with the error reached so far; otherwise it fails.",
    )

    @property
    def asked_quality(self) -> FixedQuality | TargetQuality:
        """The quality, with missing members filled in from the scene."""
        if isinstance(self.quality, TargetQuality):
            return self.quality
        sampling, own = self.scene.sampling, self.quality
        return FixedQuality(
            mode="fixed",
            antialiasing=(own and own.antialiasing) or sampling.antialiasing,
            light=(own and own.light) or sampling.light,
            precision=own.precision if own else "single",
        )


class JobState(StrEnum):
    """The states of a job. All but the first two are final."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    EXPIRED = "expired"

    @property
    def final(self) -> bool:
        """Whether a job in this state will never change again."""
        return self not in (JobState.QUEUED, JobState.RUNNING)


class Failure(Message):
    """Why a job failed."""

    code: str = Field(
        description="A word for programs: `render_failed`, `scene_not_usable`, `worker_died`, "
        "`out_of_memory`, `took_too_long`, `storage_failed`, `request_damaged`, `time_limit`."
    )
    message: str = Field(description="A sentence for people.")
    retryable: bool = Field(description="Whether the same request may succeed when it is sent again.")


class Progress(Message):
    """Progress of a job. A step is one tile in one pass."""

    done: int = Field(ge=0, description="Steps finished.")
    total: int = Field(
        ge=1, description="Steps in all; with target quality those known so far, more with each pass."
    )
    share: float = Field(
        ge=0,
        le=1,
        description="Share of the work that is done. It never falls. With target quality it is estimated "
        "from the error, and with a time limit from the time. It is 1 when the picture is finished.",
    )
    remaining_seconds: float | None = Field(
        default=None,
        ge=0,
        description="Predicted seconds until it ends; null while the job does not run, and if there is no "
        "prediction.",
    )


class ReachedError(Message):
    """Root mean square error of a linear picture, clipped to 0..1, as it is estimated from its samples.

    `low` to `high` is a 95 % interval.
    """

    estimate: float = Field(ge=0, description="The estimate.")
    low: float = Field(ge=0, description="Lower end of its interval.")
    high: float = Field(ge=0, description="Upper end of its interval.")


class Work(Message):
    """Counts of work other than rays."""

    shading_points: int = Field(default=0, ge=0, description="Points where rays hit shapes.")
    texture_lookups: int = Field(
        default=0, ge=0, description="Texture look-ups at these points; a bump map takes four per point."
    )


class Numerics(Message):
    """Counts of numerical problems. All are 0 for a good scene."""

    non_finite: int = Field(ge=0, description="Pixels that are NaN or infinite.")
    clamped: int = Field(ge=0, description="Pixels clamped to the largest float32 in some pass.")
    degenerate_dropped: int = Field(ge=0, description="Triangles left out: copies, and those without area.")
    retried: int = Field(
        ge=0, description="Triangles so thin that exact arithmetic had to decide whether they have an area."
    )


class JobCost(Message):
    """The predicted cost of a job, and its cost so far."""

    predicted_cpu_seconds: float = Field(description="CPU seconds predicted before it began.")
    cpu_seconds: float = Field(description="CPU seconds spent on finished tiles.")
    rays: dict[str, int] = Field(description="Rays cast by finished tiles, by kind.")
    work: Work = Field(default=Work(), description="Other work of finished tiles.")


class TileAtWork(Message):
    """A tile that a worker holds. The rectangle is that of a tile event."""

    tile: int = Field(ge=0, description="Index of the tile in its pass.")
    pass_index: int = Field(ge=0, description="Index of the pass; 0 is the coarse picture.")
    x0: int = Field(description="First column.")
    y0: int = Field(description="First row, from the top.")
    x1: int = Field(description="The column after the last.")
    y1: int = Field(description="The row after the last.")


class JobLinks(Message):
    """Paths of everything that belongs to a job, on the same server."""

    self: str = Field(description="The job.")
    cancel: str = Field(description="Cancels it.")
    tiles: str = Field(description="Tile events.")
    events: str = Field(description="The same as a stream.")
    plan: str = Field(description="What runs, and why.")
    image_png: str = Field(description="The picture as displayed.")
    image_npy: str = Field(description="The linear picture.")
    image_exr: str = Field(default="", description="The linear picture with all layers.")
    pause: str = Field(default="", description="Pauses it.")
    resume: str = Field(default="", description="Resumes it.")
    convergence: str = Field(default="", description="Error against time.")
    log: str = Field(default="", description="Its history.")
    request: str = Field(default="", description="The body that was sent.")
    inspections: str = Field(default="", description="Inspects a pixel.")
    focus: str = Field(default="", description="Renders a rectangle first.")
    pin: str = Field(default="", description="Keeps its picture.")
    layers: dict[str, str] = Field(default={}, description="The requested layers, by name.")


class Job(Message):
    """A job as ``GET /v1/jobs/{id}`` shows it."""

    id: str = Field(description="The job's id.")
    name: str | None = Field(default=None, description="The scene's name.")
    user: str | None = Field(default=None, description="The user who submitted it.")
    labels: dict[str, str] = Field(default={}, description="The labels of the request.")
    priority: int = Field(default=0, description="The priority of the request.")
    state: JobState = Field(description="All states but the first two are final.")
    paused: bool = Field(
        default=False,
        description="Whether the job is paused: workers get no tiles of it until it is resumed.",
    )
    cancelling: bool = Field(
        default=False,
        description="Whether the job is being cancelled: it ends when workers have stopped its tiles.",
    )
    width: int = Field(description="Columns of the picture.")
    height: int = Field(description="Rows of the picture.")
    quality: dict[str, Any] = Field(
        description="The requested quality, completed from the scene, in the form of a request.",
    )
    progress: Progress = Field(description="How much of it is rendered.")
    rendering: tuple[TileAtWork, ...] = Field(
        default=(),
        description="The tiles that workers hold now, at most two each: the one in progress and the next "
        "one.",
    )
    queue_position: int | None = Field(
        default=None,
        description="How many queued jobs start before this one, by users' turns, priority and age. It "
        "can grow. Null once the job runs, and while it is paused.",
    )
    last_seq: int = Field(ge=0, description="Number of the newest tile event; 0 before the first.")
    created_at: datetime = Field(description="When it was submitted.")
    started_at: datetime | None = Field(default=None, description="When it started.")
    run_seconds: float | None = Field(
        default=None, description="Seconds it has run, without pauses; null before it starts."
    )
    finished_at: datetime | None = Field(default=None, description="When it ended.")
    expires_at: datetime | None = Field(
        default=None,
        description="When the picture will be deleted, or earlier if space is needed. Null until the job has "
        "succeeded, while it is pinned, and if pictures are kept for ever.",
    )
    pinned: bool = Field(
        default=False, description="Whether the picture is kept until the job is unpinned or deleted."
    )
    failure: Failure | None = Field(default=None, description="Why it failed; null in other states.")
    cost: JobCost = Field(description="Its predicted cost, and its cost so far.")
    numerics: Numerics | None = Field(
        default=None, description="Counts of numerical problems; null until the picture is finished."
    )
    error: ReachedError | None = Field(
        default=None,
        description="The error reached so far, with target quality and with random samples; null if there "
        "is no estimate.",
    )
    warnings: tuple[Problem, ...] = Field(
        default=(), description="Parts of the request that are valid, but probably not intended."
    )
    links: JobLinks = Field(description="Paths of everything that belongs to it.")
    damage: str | None = Field(
        default=None,
        description="A sentence for people where a stored file of the job's picture is damaged, or the job's "
        "record in the database: then fields that cannot be read are 0, empty or null. Null for all other "
        "jobs.",
    )


class JobList(Message):
    """One page of ``GET /v1/jobs``."""

    jobs: tuple[Job, ...] = Field(description="The jobs of this page.")
    next: str | None = Field(
        default=None, description="Pass it as `cursor` to get the next page; null on the last one."
    )
    total: int | None = Field(
        default=None, description="Number of jobs on all pages, at most 10,000; null unless you asked for it."
    )


class TileEvent(Message):
    """One tile was finished in one pass. Events of a job are numbered 1, 2, 3 without gaps.

    The rectangle is half open, in pixels of the whole picture, rows from the top. With ``stride`` s > 1
    the pixels are a preview: one value stands for a block of s x s. With target quality the tiles of a pass
    are numbered from 1, and the event of tile 0 is that of the whole picture, after all others of its pass.
    """

    seq: int = Field(ge=1, description="Number of the event.")
    tile: int = Field(ge=0, description="Index of the tile in its pass.")
    pass_index: int = Field(ge=0, description="Index of the pass; 0 is the coarse picture.")
    stride: int = Field(ge=1, description="Side of the blocks of a preview; 1 for single pixels.")
    x0: int = Field(description="First column.")
    y0: int = Field(description="First row, from the top.")
    x1: int = Field(description="The column after the last.")
    y1: int = Field(description="The row after the last.")


class TileBatch(Message):
    """Tile events, as ``GET /v1/jobs/{id}/tiles`` returns them."""

    state: JobState = Field(description="The state of the job.")
    progress: Progress = Field(description="How much of it is rendered.")
    events: tuple[TileEvent, ...] = Field(description="The events, by number.")
    next: int = Field(ge=0, description="Pass it as `after` to get what follows.")
    complete: bool = Field(description="Whether the job has ended and no event follows `next`.")
    failure: Failure | None = Field(default=None, description="Why the job failed; null in other states.")


class Asset(Message):
    """A stored texture or mesh, as ``PUT /v1/assets/{sha256}`` returns it."""

    name: str = Field(description="How a scene names it: `sha256:` and 64 hexadecimal digits.")
    bytes: int = Field(ge=0, description="Size of the file.")
    media_type: str = Field(description="Type of the file, found from its content.")
    width: int = Field(description="Columns, pixels; 0 for a mesh.")
    height: int = Field(description="Rows, pixels; 0 for a mesh.")


class Version(Message):
    """The version of a service, as ``GET /version`` returns it."""

    name: Literal["penumbra"] = Field(default="penumbra", description="What this service is.")
    version: str = Field(description="Version of the package.")
    api: Literal["v1"] = Field(default="v1", description="Version of the API, as in its paths.")


Edge = Annotated[int, Field(strict=True, ge=0), WHOLE]


class Region(Closed):
    """The pixels [x0, x1) x [y0, y1), columns from the left and rows from the top."""

    x0: Edge = Field(description="First column.")
    y0: Edge = Field(description="First row.")
    x1: Edge = Field(description="The column after the last.")
    y1: Edge = Field(description="The row after the last.")

    @model_validator(mode="after")
    def _holds_a_pixel(self) -> Self:
        if self.x0 >= self.x1 or self.y0 >= self.y1:
            raise PydanticCustomError(
                "no_pixels", "This rectangle has no pixels: x0 must be below x1, and y0 below y1."
            )
        return self


class LogEntry(Message):
    """One event in the history of a job."""

    at: datetime | None = Field(
        default=None, description="When it happened; null if only its order is known."
    )
    event: str = Field(
        description="A word for programs: `submitted`, `shared`, `started`, `step_repeated`, "
        "`pass_finished`, `composed_again`, `paused`, or the state in which the job ended. Later versions "
        "may have more."
    )
    message: str = Field(description="A sentence for people.")
    pass_index: int | None = Field(default=None, description="The pass, if it is about one.")
    tile: int | None = Field(default=None, description="The tile, if it is about one.")
    attempts: int | None = Field(default=None, description="How often the tile has been tried.")
    workers_lost: int | None = Field(default=None, description="How many workers died on the tile.")


class JobLog(Message):
    """The history of a job, as ``GET /v1/jobs/{id}/log`` returns it."""

    job: str = Field(description="The job's id.")
    state: JobState = Field(description="The state of the job.")
    entries: tuple[LogEntry, ...] = Field(description="The history, in order.")
    more: int = Field(default=0, ge=0, description="How many retried tiles are not listed.")
