"""Plans, quotes and convergence: what runs, what it costs, and how its error falls."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.api.jobs import JobState, ReachedError
from schemas.base import Closed, Message
from schemas.quality import Quality
from schemas.scene import Scene


class PlanStage(Message):
    """One stage of the rendering, with the lines of the scene that asked for it."""

    name: str = Field(description="The stage.")
    effect: str = Field(description="The effect that it works for.")
    pointers: tuple[str, ...] = Field(
        description="JSON Pointers to what asked for it, in the scene or, over HTTP, in the request."
    )
    detail: str = Field(description="What it does, in a sentence.")
    share: float | None = Field(
        default=None, ge=0, le=1, description="Expected share of the CPU time, 0 to 1."
    )


class LeftOut(Message):
    """An effect that no line of the scene calls for."""

    effect: str = Field(description="The effect.")
    pointers: tuple[str, ...] = Field(
        default=(),
        description="JSON Pointers to what names it without effect, if any.",
    )
    reason: str = Field(description="Why it does not run.")


class PlanCost(Message):
    """What the plan is expected to cost."""

    camera_rays: int = Field(ge=0, description="Rays from the camera.")
    shadow_rays: int = Field(ge=0, description="Rays from points to lights, at most.")
    cpu_seconds: float = Field(ge=0, description="Predicted CPU seconds.")


class PlanDocument(Message):
    """The whole plan, as it is printed and served."""

    stages: tuple[PlanStage, ...] = Field(description="What runs, in order.")
    pilot_samples: tuple[PlanStage, ...] = Field(
        default=(),
        description="What the pilot samples of target quality do differently; none with fixed quality.",
    )
    left_out: tuple[LeftOut, ...] = Field(description="What does not run, and why.")
    cost: PlanCost = Field(description="What it is expected to cost.")


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
    next_halving: NextHalving | None = Field(description="Null where it cannot be predicted.")
    reason: str | None = Field(
        default=None, description="Why one of the two is null, or has no upper end, as a sentence."
    )


class QuoteRequest(Closed):
    """The body of ``POST /v1/quotes``."""

    scene: Scene = Field(description="The scene to render.")
    quality: Quality | None = Field(
        default=None, description="What is to be priced first, in place of the scene's `sampling`."
    )
    target_error: Annotated[float, Field(strict=True, ge=1e-6, le=1)] | None = Field(
        default=None,
        description="A requested error, as in a quality of mode `target`: `for_error` reaches it soonest.",
    )
    seconds: Annotated[float, Field(strict=True, gt=0, le=86400)] | None = Field(
        default=None, description="A given time: `for_seconds` is what comes closest in it."
    )


class Predicted(Message):
    """A prediction, and an interval that holds what will be measured in 95 of 100 cases."""

    estimate: float = Field(ge=0, description="The prediction.")
    low: float = Field(ge=0, description="Lower end of its interval.")
    high: float = Field(ge=0, description="Upper end of its interval.")


class Offer(Message):
    """A quality with what it is predicted to cost and to reach."""

    quality: Quality = Field(description="As a job request takes it.")
    cpu_seconds: Predicted = Field(description="CPU seconds of all processes together.")
    seconds: Predicted = Field(description="Seconds, if all workers do nothing else.")
    error: Predicted | None = Field(
        default=None,
        description="Root mean square error of the linear picture, clipped to 0..1; null where the pilot "
        "could not estimate it.",
    )


class EffectShare(Message):
    """What an effect adds to the time of the quality that was asked for."""

    effect: str = Field(description="The effect.")
    pointers: tuple[str, ...] = Field(
        description="JSON Pointers to what asked for it, in the scene or, over HTTP, in the request."
    )
    cpu_seconds: float = Field(description="CPU seconds that go when it goes; below 0 where it saves work.")
    share: float = Field(le=1, description="The same as a share of all CPU seconds.")


class Pilot(Message):
    """What was rendered for the quote."""

    seconds: float = Field(ge=0, description="Seconds that it took.")
    blocks: int = Field(ge=0, description="Blocks of the picture that were timed.")
    pixels: int = Field(ge=0, description="Pixels that were sampled twice to learn their errors.")
    target_errors: int = Field(ge=0, description="Target errors whose pictures were begun.")


class Quote(Message):
    """The answer of ``POST /v1/quotes``."""

    asked: Offer | None = Field(
        description="The quality asked for; null where there was no time to price it."
    )
    offers: tuple[Offer, ...] = Field(description="Several qualities, with the one asked for among them.")
    for_error: Offer | None = Field(default=None, description="What reaches `target_error` soonest.")
    for_seconds: Offer | None = Field(default=None, description="What comes closest within `seconds`.")
    effects: tuple[EffectShare, ...] = Field(
        description="What each effect costs, as far as there was time to measure it, most costly first."
    )
    price: PlanCost = Field(description="What admission goes by: predicted from the plan, without a pilot.")
    workers: int = Field(ge=1, description="Processes that `seconds` counts on.")
    pilot: Pilot
