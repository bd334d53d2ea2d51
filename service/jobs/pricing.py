"""What a request is expected to cost, and whether that is allowed."""

from __future__ import annotations

import renderer
from accuracy.quotes.prices import price
from schemas.jobs import JobRequest
from schemas.plans import PlanDocument
from schemas.problems import Problem
from schemas.quality import TargetQuality
from service.settings import Settings


def target_of(request: JobRequest) -> TargetQuality | None:
    """Give the error that a request asks for, if it is one."""
    return request.quality if isinstance(request.quality, TargetQuality) else None


def priced(plan: renderer.RenderPlan, quoted: float | None, workers: int) -> PlanDocument:
    """Describe a plan with its price: that which a pilot has found, or else the one that the plan predicts.

    Parameters
    ----------
    plan
        That of the request.
    quoted
        CPU seconds that were quoted for it, if it was.
    workers
        What all of them can do in a time limit bounds the price.
    """
    cost = price(plan, workers)
    if quoted is not None:
        cost = cost.model_copy(update={"cpu_seconds": quoted})
    return plan.describe().model_copy(update={"cost": cost})


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
