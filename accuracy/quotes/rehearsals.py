"""Cost of target quality: the picture is begun, and its forecast predicts the rest.

If there is time to finish it, its cost is known.
"""

import time
from dataclasses import dataclass, replace
from math import hypot

from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.timings import TIMING_DEVIATION
from accuracy.statistics import factor
from renderer.adaptive.adaptive_render import attempt
from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import State
from renderer.adaptive.forecast import DEVIATIONS, price
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan

SECONDS_PER_PIXEL = 7e-8
"""CPU seconds a pixel before the first pass: 1.2 s in all at 4096 x 4096."""


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """Prediction from the beginning of a picture of target quality.

    Attributes
    ----------
    cpu_seconds : Interval
        Of the whole picture.
    reached : Interval or None
        The error of the whole picture, if it was completed.
    """

    cpu_seconds: Interval
    reached: Interval | None = None


def rehearse(plan: RenderPlan, deadline: Deadline) -> Rehearsal:
    """Render a picture of target quality as far as there is time, and predict the rest."""
    if SECONDS_PER_PIXEL * plan.width * plan.height > deadline.left:
        return Rehearsal(factor(DEVIATIONS[State.LATTICE]).scaled(price(plan, 1).cpu_seconds))
    begun, driver, more = time.thread_time(), Driver.begin(plan), True
    while more:
        ahead, before = driver.forecast(), time.thread_time() - begun
        if not _run_pass(driver, deadline):
            spent = time.thread_time() - begun
            guess = factor(hypot(ahead.deviation, TIMING_DEVIATION)).scaled(
                max(before + ahead.left(0.0), spent)
            )
            return Rehearsal(Interval(guess.estimate, max(guess.low, spent), guess.high))
        more = driver.end_pass(last=False)
    error = driver.estimate.error
    assert error is not None
    reached = Interval(error.estimate, error.low, error.high)
    return Rehearsal(factor(TIMING_DEVIATION).scaled(time.thread_time() - begun), reached)


def _run_pass(driver: Driver, deadline: Deadline) -> bool:
    """Render the tiles of a pass; False if there was no time for all of them."""
    for request in driver.requests(replace(deadline, ray_seconds=driver.ray_seconds)):
        samples = attempt(driver.estimate.plan, request)
        if samples is None:
            return False
        driver.take(request.tile, samples)
    return True
