"""What became of a job, step by step."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from schemas.jobs import JobState, Message


class LogEntry(Message):
    """One thing that happened."""

    at: datetime | None = Field(
        default=None, description="When; null where only its place among the others is known."
    )
    event: str = Field(
        description="A word for programs: `submitted`, `shared`, `started`, `step_repeated`, "
        "`pass_finished`, `composed_again`, or the state in which the job ended. Later versions may know "
        "more."
    )
    message: str = Field(description="A sentence for people.")
    pass_index: int | None = Field(default=None, description="The pass that it is about.")
    tile: int | None = Field(default=None, description="The tile that it is about.")
    attempts: int | None = Field(default=None, description="How often it was tried so far.")
    workers_lost: int | None = Field(default=None, description="How many workers died of it.")


class JobLog(Message):
    """The answer of ``GET /v1/jobs/{id}/log``."""

    job: str = Field(description="The job's id.")
    state: JobState
    entries: tuple[LogEntry, ...] = Field(description="In the order in which it happened.")
    more: int = Field(default=0, ge=0, description="How many repeated steps are not listed.")
