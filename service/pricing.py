"""What a request is expected to cost, and whether that is allowed."""

from __future__ import annotations

import renderer
from schemas.jobs import JobRequest
from schemas.plans import PlanDocument
from schemas.problems import Problem
from schemas.quality import TargetQuality
from service.settings import Settings

SAMPLES, ERROR = 4, 1 / 255
"""An error of one step of 8 bits takes about as much as so many samples in every pixel."""

FEWEST, MOST = 1, 1 << 16
"""Samples in the mean pixel: nearly all are looked at once, and none gets more than the renderer takes."""


def target_of(request: JobRequest) -> TargetQuality | None:
    """Give the error that a request asks for, if it is one."""
    return request.quality if isinstance(request.quality, TargetQuality) else None


def priced(plan: renderer.RenderPlan, target: TargetQuality | None, settings: Settings) -> PlanDocument:
    """Describe a plan with its price.

    That of target quality is a rough one: four samples in every pixel at an error of 1/255, and so many times
    as many as the error is smaller. A time limit bounds it by what all workers can do in that time.
    """
    description = plan.describe()
    if target is None:
        return description
    samples = min(max(SAMPLES * ERROR / target.error, FEWEST), MOST)
    scale = samples / plan.antialiasing.samples
    seconds = description.cost.cpu_seconds * scale
    if target.time_limit is not None:
        seconds = min(seconds, target.time_limit * settings.workers)
    changes = {
        "camera_rays": round(description.cost.camera_rays * scale),
        "shadow_rays": round(description.cost.shadow_rays * scale),
        "cpu_seconds": seconds,
    }
    return description.model_copy(update={"cost": description.cost.model_copy(update=changes)})


def check_cost(description: PlanDocument, target: TargetQuality | None, settings: Settings) -> None:
    """Refuse what is predicted to cost more than the service allows.

    Raises
    ------
    renderer.SceneError
        Says what to ask less of.
    """
    predicted, limit = description.cost.cpu_seconds, settings.max_cpu_seconds
    if predicted <= limit:
        return
    place, advice = ("/scene", "Ask for fewer pixels, samples or light samples.")
    if target is not None:
        place, advice = ("/quality/error", "Ask for fewer pixels or a larger error, or set a time_limit.")
    detail = (
        f"This is predicted to take {predicted:.0f} CPU seconds, more than the {limit:.0f} allowed. {advice}"
    )
    raise renderer.SceneError([Problem(pointer=place, detail=detail, code="cost")])
