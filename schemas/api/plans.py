"""Plans of stages, quotes of cost and error, and convergence of a job."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from schemas.api.jobs import JobState, ReachedError
from schemas.base import Closed, Message
from schemas.errors import Problem
from schemas.quality import Quality
from schemas.scene import Scene


class PlanStage(Message):
    """One stage of the rendering, with the parts of the scene that require it."""

    name: str = Field(description="The stage.")
    effect: str = Field(description="The effect that needs it.")
    pointers: tuple[str, ...] = Field(
        description="JSON Pointers to what requires it, in the scene or, over HTTP, in the request."
    )
    detail: str = Field(description="What it does, in a sentence.")
    share: float | None = Field(
        default=None, ge=0, le=1, description="Expected share of the CPU time, 0 to 1."
    )


class LeftOut(Message):
    """An effect that does not run."""

    effect: str = Field(description="The effect.")
    pointers: tuple[str, ...] = Field(
        default=(),
        description="JSON Pointers to parts that set it in vain.",
    )
    reason: str = Field(description="Why it does not run.")


class PlanCost(Message):
    """The predicted cost of a plan."""

    camera_rays: int = Field(ge=0, description="Rays from the camera.")
    shadow_rays: int = Field(ge=0, description="Rays from points to lights, at most.")
    cpu_seconds: float = Field(ge=0, description="Predicted CPU seconds.")


class PlanDocument(Message):
    """The plan of a render."""

    stages: tuple[PlanStage, ...] = Field(description="What runs, in order.")
    pilot_samples: tuple[PlanStage, ...] = Field(
        default=(),
        description="What the pilot samples of target quality do differently; none with fixed quality.",
    )
    left_out: tuple[LeftOut, ...] = Field(description="What does not run, and why.")
    cost: PlanCost = Field(description="The predicted cost.")
    warnings: tuple[Problem, ...] = Field(
        default=(),
        description="Parts of the request that are valid, but probably not intended; none in the plan of a "
        "job, which has them itself.",
    )


class Interval(Message):
    """An estimate with a 95 % interval."""

    estimate: float = Field(description="The estimate.")
    low: float = Field(description="Lower end of its interval.")
    high: float | None = Field(description="Upper end of its interval; null if it has none.")


class PassCost(Message):
    """Cumulative totals of a picture at the end of a pass."""

    pass_index: int = Field(ge=0, description="Index of the pass; 0 is the coarse picture.")
    seconds: float = Field(
        ge=0, description="Wall-clock time since the job began to run, whatever else ran meanwhile."
    )
    cpu_seconds: float = Field(ge=0, description="CPU seconds of all workers.")
    rays: dict[str, int] = Field(description="Rays by kind.")
    error: ReachedError | None = Field(description="The remaining error; null if there is no estimate.")


class NextHalving(Message):
    """The further cost of half the newest error."""

    seconds: Interval = Field(
        description="Wall-clock time, at the rate at which CPU seconds were spent so far."
    )
    cpu_seconds: Interval = Field(description="CPU seconds of all workers.")


class Convergence(Message):
    """Error against time, as ``GET /v1/jobs/{id}/convergence`` returns it."""

    job: str = Field(description="The job's id.")
    state: JobState = Field(description="The state of the job.")
    mode: Literal["fixed", "target"] = Field(description="The mode of the quality.")
    target_error: float | None = Field(default=None, description="The requested error, with target quality.")
    passes: tuple[PassCost, ...] = Field(description="The passes that are finished, in their order.")
    order: Interval | None = Field(
        description="The error is proportional to CPU seconds to this power: -0.5 for independent samples, "
        "which take four times as long for half the error. Null if there are too few passes."
    )
    next_halving: NextHalving | None = Field(
        description="What half of the error would cost; null if there is no prediction."
    )
    reason: str | None = Field(
        default=None, description="Why `order` or `next_halving` is null or has no upper end."
    )


class QuoteRequest(Closed):
    """The body of ``POST /v1/quotes``."""

    scene: Scene = Field(description="The scene to render.")
    quality: Quality | None = Field(
        default=None, description="The quality that is priced first, in place of the scene's `sampling`."
    )
    target_error: Annotated[float, Field(strict=True, ge=1e-6, le=1)] | None = Field(
        default=None,
        description="A target error: `for_error` is the cheapest quality that reaches it.",
    )
    seconds: Annotated[float, Field(strict=True, gt=0, le=86400)] | None = Field(
        default=None, description="A time limit: `for_seconds` is the most accurate quality within it."
    )


class Predicted(Message):
    """A prediction, and a 95 % interval of what will be measured."""

    estimate: float = Field(ge=0, description="The prediction.")
    low: float = Field(ge=0, description="Lower end of its interval.")
    high: float = Field(ge=0, description="Upper end of its interval.")


class Offer(Message):
    """A quality with its predicted cost and error."""

    quality: Quality = Field(description="The quality, in the form of a job request.")
    cpu_seconds: Predicted = Field(description="CPU seconds of all processes together.")
    seconds: Predicted = Field(description="Wall-clock time, if all workers do nothing else.")
    error: Predicted | None = Field(
        default=None,
        description="Root mean square error of the linear picture, clipped to 0..1; null if the pilot "
        "could not estimate it.",
    )
    error_unknown: str | None = Field(default=None, description="Why `error` is null.")
    rough: str | None = Field(
        default=None, description="Why the cost is a rough guess with a wide interval; null if it is not."
    )


class EffectShare(Message):
    """The cost of a light, map, mirror or lens in the quality that is priced first."""

    effect: str = Field(description="The effect.")
    pointers: tuple[str, ...] = Field(
        description="JSON Pointers to what requires it, in the scene or, over HTTP, in the request."
    )
    cpu_seconds: float = Field(
        description="CPU seconds saved without it; below 0 if it saves more than it costs."
    )
    share: float = Field(le=1, description="The same as a share of all CPU seconds.")


class Pilot(Message):
    """Pixels that were rendered for the quote."""

    seconds: float = Field(ge=0, description="Seconds that it took.")
    blocks: int = Field(ge=0, description="Blocks of the picture that were timed.")
    pixels: int = Field(ge=0, description="Pixels that were sampled twice to estimate their errors.")
    target_errors: int = Field(ge=0, description="Target errors that were tried on the picture itself.")


class Quote(Message):
    """Predictions, as ``POST /v1/quotes`` returns them."""

    asked: Offer | None = Field(
        description="The offer for the requested quality; null if there was no time to price it."
    )
    offers: tuple[Offer, ...] = Field(
        description="Several qualities: the scene's patterns and Sobol patterns, and target errors."
    )
    for_error: Offer | None = Field(
        default=None, description="The cheapest that reaches `target_error`; null if none does."
    )
    for_seconds: Offer | None = Field(
        default=None, description="The most accurate within `seconds`; null if none is."
    )
    effects: tuple[EffectShare, ...] = Field(
        description="What each effect costs, as far as there was time to measure it, the most expensive "
        "first."
    )
    price: PlanCost = Field(description="The cost predicted from the plan alone.")
    workers: int = Field(ge=1, description="Processes that `seconds` assumes.")
    pilot: Pilot = Field(description="How long it took, and what was rendered.")
