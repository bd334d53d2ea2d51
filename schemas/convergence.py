"""What the error of a picture costs: its passes, how fast the error falls, and what half of it would cost."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from schemas.jobs import JobState, Message, ReachedError


class Interval(Message):
    """An estimate with an interval that holds the true value in 95 of 100 cases."""

    estimate: float
    low: float = Field(description="Lower end of its interval.")
    high: float | None = Field(description="Upper end of its interval; null where nothing bounds it.")


class PassCost(Message):
    """What a picture had taken when a pass ended, all passes before it included."""

    pass_index: int = Field(ge=0, description="Index of the pass; 0 is the coarse picture.")
    seconds: float = Field(ge=0, description="Since the job began to run, whatever else ran meanwhile.")
    cpu_seconds: float = Field(ge=0, description="CPU seconds of all workers.")
    rays: dict[str, int] = Field(description="Rays by kind.")
    error: ReachedError | None = Field(description="Null where it is not known.")


class NextHalving(Message):
    """What it would cost to halve the newest error, beyond what it has cost to reach it."""

    seconds: Interval = Field(description="At the rate at which CPU seconds were spent so far.")
    cpu_seconds: Interval


class Convergence(Message):
    """The answer of ``GET /v1/jobs/{id}/convergence``: error against time."""

    job: str = Field(description="The job's id.")
    state: JobState
    mode: Literal["fixed", "target"] = Field(description="How the quality was asked for.")
    target_error: float | None = Field(default=None, description="The error asked for, with target quality.")
    passes: tuple[PassCost, ...] = Field(description="The passes that are finished, in their order.")
    order: Interval | None = Field(
        description="The error falls like CPU seconds to this power. Null where nothing can be fitted."
    )
    next_halving: NextHalving | None = Field(description="Null where it cannot be told.")
    reason: str | None = Field(
        default=None, description="Why one of the two is null, or has no upper end, as a sentence."
    )
