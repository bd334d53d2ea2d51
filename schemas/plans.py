"""What will run for a scene, who asked for it, and what it is expected to cost."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class PlanStage(_Part):
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


class LeftOut(_Part):
    """An effect that no line of the scene calls for."""

    effect: str = Field(description="The effect.")
    pointers: tuple[str, ...] = Field(
        default=(),
        description="JSON Pointers to what names it without effect, if any.",
    )
    reason: str = Field(description="Why it does not run.")


class PlanCost(_Part):
    """What the plan is expected to cost."""

    camera_rays: int = Field(ge=0, description="Rays from the camera.")
    shadow_rays: int = Field(ge=0, description="Rays from points to lights, at most.")
    cpu_seconds: float = Field(ge=0, description="Predicted CPU seconds.")


class PlanDocument(_Part):
    """The whole plan, as it is printed and served."""

    stages: tuple[PlanStage, ...] = Field(description="What runs, in order.")
    pilot_samples: tuple[PlanStage, ...] = Field(
        default=(),
        description="What the pilot samples of target quality do differently; none with fixed quality.",
    )
    left_out: tuple[LeftOut, ...] = Field(description="What does not run, and why.")
    cost: PlanCost = Field(description="What it is expected to cost.")
