"""Forecast of a picture of target quality: the CPU seconds of its next pass and of all later ones.

Rays times prices. The rays of the next pass are known, those of later ones predicted: from the allocation,
and before there are samples from the plan alone. A price is the measured CPU time of a ray so far, or the
plan's estimate. Progress, tiles, time limits and quotes share this forecast.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

from renderer.adaptive.estimate import Estimate, State
from renderer.adaptive.levels import COUNTS
from renderer.plan.plan import RenderPlan

PILOTS, SAMPLES, LAYERS = "pilots", "samples", "layers"
"""Kinds of rays."""

Prices = Mapping[str, float]
"""CPU seconds of a camera ray by kind."""

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

AFTER_PROBES = 1.35
"""Cost of all passes from the probes on over that of the probes, with the least mean error of the
logarithm."""

MAX_PROGRESS = 0.99
"""Largest progress of an unfinished picture."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """Predicted CPU seconds of the next pass and of all later ones."""

    next: float
    later: float

    def share(self, spent: float, part: float) -> float:
        """Progress, 0 to `MAX_PROGRESS`, with a part of the next pass done."""
        left = self.next * (1.0 - min(part, 1.0)) + self.later
        return min(spent / (spent + left), MAX_PROGRESS) if spent > 0 else 0.0


def share_by(work: float, elapsed: float, limit: float) -> float:
    """Progress of a picture that ends with its work or with its time limit, whichever is first."""
    return min(max(work, elapsed / limit), MAX_PROGRESS)


def seconds_left(share: float, elapsed: float, limit: float) -> float | None:
    """Seconds until the picture is finished, None before any progress."""
    return min(elapsed / share - elapsed, max(limit - elapsed, 0.0)) if share > 0 else None


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
    return {kind: times * cost.cpu_seconds / cost.camera_rays for kind, times in USUAL_PRICE_RATIOS.items()}


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
    if estimate.state.is_measured:
        # Samples reveal more error, so that one pass more follows than is planned.
        following = max(_samples_to_come(estimate) - rays, 0.0) + TILE_CALL_RAYS
        return Forecast(upcoming, following * prices[SAMPLES])
    if estimate.state is State.PROBES:
        return Forecast(upcoming, (AFTER_PROBES - 1) * upcoming)
    price = prices[SAMPLES] / USUAL_PRICE_RATIOS[SAMPLES]
    return Forecast(upcoming, rays_of_picture(estimate.have.size, estimate.target) * price)


def _samples_to_come(estimate: Estimate) -> float:
    """Samples that the allocation predicts, or those so far times the factor by which the error is to fall.

    The allocation alone predicts errors of 4/255 to 0.03/255 well, but never more than one pass may request.
    """
    assert estimate.error is not None
    times = estimate.error.estimate / estimate.target - 1.0
    return max(float(estimate.predicted_rays), times * float(COUNTS[estimate.have].sum()))
