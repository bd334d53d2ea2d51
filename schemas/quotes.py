"""What a picture would cost and how far off it would be, before it is rendered: ``POST /v1/quotes``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from schemas.base import Closed
from schemas.jobs import Message
from schemas.plans import PlanCost
from schemas.quality import Quality
from schemas.scene import Scene


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
        "could not tell.",
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
