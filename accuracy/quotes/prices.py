"""Prices predicted from the plan alone, without a pilot."""

from renderer.adaptive.forecast import rays_of_picture
from renderer.plan.plan import RenderPlan
from schemas.api.plans import PlanCost
from schemas.quality import TargetQuality


def price(plan: RenderPlan, workers: int) -> PlanCost:
    """Predict what a plan costs, without rendering any of it.

    That of target quality is a rough guess. A time limit bounds it by what all workers can do in that time.
    """
    cost, target = plan.describe().cost, plan.quality
    if not isinstance(target, TargetQuality):
        return cost
    scale = rays_of_picture(plan.width * plan.height, target.error) / cost.camera_rays
    seconds = cost.cpu_seconds * scale
    if target.time_limit is not None:
        seconds = min(seconds, target.time_limit * workers)
    return PlanCost(
        camera_rays=round(cost.camera_rays * scale),
        shadow_rays=round(cost.shadow_rays * scale),
        cpu_seconds=seconds,
    )
