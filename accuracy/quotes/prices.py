"""What a picture is taken to cost where there is no time for a pilot: predicted from the plan alone."""

from renderer.plan.plan import RenderPlan
from schemas.api.plans import PlanCost
from schemas.quality import TargetQuality

SAMPLES, ERROR = 4, 1 / 255
"""Samples in every pixel that cost about as much as an error of 1/255."""

FEWEST, MOST = 1, 1 << 16
"""Samples in the mean pixel: nearly all get one pilot sample, and none gets more than the renderer takes."""


def price(plan: RenderPlan, workers: int) -> PlanCost:
    """Predict what a plan costs, without rendering any of it.

    That of target quality is a rough one: four samples in every pixel at an error of 1/255, and so many times
    as many as the error is smaller. A time limit bounds it by what all workers can do in that time.
    """
    cost, target = plan.describe().cost, plan.quality
    if not isinstance(target, TargetQuality):
        return cost
    samples = min(max(SAMPLES * ERROR / target.error, FEWEST), MOST)
    scale = samples / plan.antialiasing.samples
    seconds = cost.cpu_seconds * scale
    if target.time_limit is not None:
        seconds = min(seconds, target.time_limit * workers)
    return PlanCost(
        camera_rays=round(cost.camera_rays * scale),
        shadow_rays=round(cost.shadow_rays * scale),
        cpu_seconds=seconds,
    )
