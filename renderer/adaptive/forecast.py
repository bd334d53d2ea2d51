"""Forecast of a picture of target quality: the CPU seconds of its next pass and of all later ones.

Rays times prices. The rays of the next pass are known, those of later ones predicted: by the controller's
allocation, and before the probes from the plan alone. A price is the measured CPU time of a ray so far, or
the plan's estimate. Progress, tiles, time limits, prices and quotes share this forecast.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, sqrt

from renderer.adaptive.estimate import Estimate, State
from renderer.adaptive.time_limits import LAST_SECONDS
from renderer.plan.plan import RenderPlan
from schemas.api.plans import PlanCost
from schemas.quality import TargetQuality

PILOTS, SAMPLES, LAYERS = "pilots", "samples", "layers"
"""Kinds of rays."""

MERGING = "merging"
"""Merging the tiles of a pass, and the decision after it."""

Prices = Mapping[str, float]
"""CPU seconds of a camera ray by kind, and of merging a pass."""

USUAL_PRICE_RATIOS = {PILOTS: 4.0, SAMPLES: 6.4, LAYERS: 0.5}
"""Price of a ray over the plan's estimate, until it is measured: medians of 140 random and gallery pictures
of 112 and 160 pixels. Pilot samples have many light points, layers none. From the price of pilot samples that
of samples is predicted to 0.5 in the logarithm, from the plan alone to 0.75."""

TILE_CALL_RAYS = 2000.0
"""Fixed cost of a tile, in rays. With it the price of one pass predicts that of the next to 0.5 in the
logarithm, without it to 0.9."""

RAYS_PER_SIDE = 2000.0
"""Rays of a picture at an error of 1/255 for each pixel of its side, at the plan's price: about the median of
the same pictures, and off by 0.8 in the logarithm."""

DEVIATIONS = {State.LATTICE: 0.85, State.PROBES: 0.45, State.SAMPLE: 0.25}
"""Standard deviation of the logarithm of the predicted cost of a whole picture, by the kind of the next pass:
in the pictures of `USUAL_PRICE_RATIOS`. In 19 random pictures it is 0.67, 0.55 and 0.19."""

MAX_LATER_PASSES = 2
"""Most passes that are expected after the next one, however much work they have: the median of passes that
the allocation exceeds, in 40 random and 13 gallery pictures."""

MAX_KNOWN_DEVIATION = 0.5
"""Largest deviation of a forecast that is reported as remaining time. Before the probes, pictures whose every
pixel is sampled have taken 30 times what was left by the forecast."""

MAX_PROGRESS = 0.99
"""Largest progress of an unfinished picture."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """Predicted CPU seconds of a picture.

    Attributes
    ----------
    next, later : float
        Of the tiles of the next pass, and of all the rest.
    deviation : float
        Standard deviation of the logarithm of the whole cost, past passes included.
    """

    next: float
    later: float
    deviation: float

    def left(self, part: float) -> float:
        """CPU seconds to come with a part of the next pass done."""
        return self.next * (1.0 - min(part, 1.0)) + self.later

    def share(self, spent: float, part: float) -> float:
        """Progress, 0 to `MAX_PROGRESS`, after `spent` CPU seconds."""
        return min(spent / (spent + self.left(part)), MAX_PROGRESS) if spent > 0 else 0.0

    def seconds_left(self, spent: float, part: float, elapsed: float) -> float:
        """Seconds until the picture is finished, inf where samples have not told yet how many it needs.

        CPU seconds to come take as long as those `spent` in the `elapsed` seconds did.
        """
        known = spent > 0 and self.deviation <= MAX_KNOWN_DEVIATION
        return self.left(part) * elapsed / spent if known else inf


UNKNOWN = Forecast(0.0, 0.0, inf)
"""Before there is any forecast, and after the last pass."""


def share_by(work: float, elapsed: float, limit: float) -> float:
    """Progress of a picture that ends with its work or with its time limit, whichever is first."""
    return min(max(work, elapsed / limit), MAX_PROGRESS)


def limited(seconds: float, elapsed: float, limit: float) -> float | None:
    """Seconds until a picture is finished with its work or at its time limit; None if neither is known."""
    left = min(seconds, max(limit - elapsed, 0.0))
    return left if left < inf else None


@dataclass(slots=True)
class Progress:
    """Reported progress of a picture: neither the share of the work nor that of the tiles ever falls.

    Attributes
    ----------
    limit : float
        Time limit, seconds; inf if there is none.
    share : float
        Part of the work that is done.
    total : int
        Expected number of tiles, at least one more than are done.
    """

    limit: float
    share: float = 0.0
    total: int = 0

    def note(self, work: float, done: int, elapsed: float) -> None:
        """Update with a share of the work and the number of tiles that are done."""
        self.share = max(self.share, share_by(work, elapsed, self.limit))
        expected = round(done / self.share) if self.share > 0 else 0
        most = done * self.total // (done - 1) if done > 1 else expected
        self.total = max(done + 1, min(expected, most))


def usual_prices(plan: RenderPlan) -> dict[str, float]:
    """Prices of rays before any is traced."""
    cost = plan.describe().cost
    rays = {kind: times * cost.cpu_seconds / cost.camera_rays for kind, times in USUAL_PRICE_RATIOS.items()}
    return rays | {MERGING: LAST_SECONDS * plan.width * plan.height}


def price(plan: RenderPlan, workers: int) -> PlanCost:
    """Predict what a plan costs, without rendering any of it.

    That of target quality is a rough guess. A time limit bounds it by what all workers can do in that time.
    """
    cost, target = plan.describe().cost, plan.quality
    if not isinstance(target, TargetQuality):
        return cost
    scale = rays_of_picture(plan.width * plan.height, target.error) / cost.camera_rays
    limit = inf if target.time_limit is None else target.time_limit * workers
    return PlanCost(
        camera_rays=round(cost.camera_rays * scale),
        shadow_rays=round(cost.shadow_rays * scale),
        cpu_seconds=min(cost.cpu_seconds * scale, limit),
    )


def kind_of(estimate: Estimate) -> str:
    """Kind of rays of the next pass."""
    return PILOTS if estimate.piloted and estimate.state is State.LATTICE else SAMPLES


def rays_of_picture(pixels: int, error: float) -> float:
    """Camera rays of target quality predicted without samples: many lie along edges, as long as the side."""
    return max(RAYS_PER_SIDE * sqrt(pixels) / (255 * error), float(pixels))


def measured(prices: Prices, kind: str, seconds: float, rays: float, tiles: int) -> Prices:
    """Prices after a pass, from the CPU seconds of its rays."""
    price = seconds / (rays + TILE_CALL_RAYS * tiles)
    samples = price * USUAL_PRICE_RATIOS[SAMPLES] / USUAL_PRICE_RATIOS[kind]
    return {**prices, SAMPLES: samples, kind: price}


def forecast(estimate: Estimate, prices: Prices) -> Forecast:
    """Predict the cost of the rest of a picture, the next pass being decided or in progress."""
    kind, rays = kind_of(estimate), estimate.work_wanted()
    upcoming = (rays + TILE_CALL_RAYS) * prices[kind]
    if estimate.state is State.LATTICE:
        following = rays_of_picture(estimate.have.size, estimate.target) / USUAL_PRICE_RATIOS[SAMPLES]
    elif estimate.state is State.PROBES:
        following = float(estimate.predicted_rays)
    else:
        following = max(estimate.predicted_rays - rays, 0.0)
    # Later passes have about as much work as this one; probes are followed by samples in any case.
    passes = min(max(following / rays, estimate.state is not State.SAMPLE), MAX_LATER_PASSES)
    later = (following + TILE_CALL_RAYS * passes) * prices[SAMPLES] + (1 + passes) * prices[MERGING]
    return Forecast(upcoming, later, DEVIATIONS[estimate.state])
