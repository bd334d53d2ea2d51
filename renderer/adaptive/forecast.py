"""How much of a picture of target quality is done, and what the rest will cost: rays times prices.

What the next pass asks for is known; what others will ask for is predicted, before there are samples from the
plan alone. A price is what a ray has cost so far, before any is traced what the plan says of it. Progress,
tiles, time limits and quotes rely on this one prediction.
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

USUAL = {PILOTS: 4.0, SAMPLES: 6.4, LAYERS: 0.5}
"""Price of a ray over what the plan says of one, until it is measured: medians of 140 random and gallery
pictures of 112 and 160 pixels. Pilot samples have many light points, layers none. Samples cost 1.6 times what
pilot samples do: the logarithm is off by 0.5, and from the plan alone by 0.75."""

CALLS = 2000.0
"""Rays that cost as much as the calls of a tile. With them the price of one pass predicts that of the next to
0.5 in the logarithm, without them to 0.9."""

RAYS_PER_SIDE = 2000.0
"""Rays of a picture at an error of 1/255, at the price of the plan, for each pixel of its side: about the
median of the same pictures. The logarithm is off by 0.8, so that this is a guess."""

AFTER_PROBES = 1.35
"""Cost of all passes from the probes on over that of the probes, where the mean error of the logarithm is
least."""

MOST = 0.99
"""Largest progress of a picture that is not finished."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """CPU seconds that the next pass and all later ones are predicted to take."""

    next: float
    later: float

    def share(self, spent: float, part: float) -> float:
        """Share of the picture that is done, 0 to `MOST`, with a part of the next pass."""
        left = self.next * (1.0 - min(part, 1.0)) + self.later
        return min(spent / (spent + left), MOST) if spent > 0 else 0.0


def share_by(work: float, elapsed: float, limit: float) -> float:
    """Share that is done where the picture ends with its work or with its time limit, whichever is first."""
    return min(max(work, elapsed / limit), MOST)


def seconds_left(share: float, elapsed: float, limit: float) -> float | None:
    """Seconds until the picture is finished, None where nothing is done to predict them from."""
    return min(elapsed / share - elapsed, max(limit - elapsed, 0.0)) if share > 0 else None


@dataclass(slots=True)
class Progress:
    """The reported progress of a picture: neither the share of the work nor that of the tiles ever falls.

    Attributes
    ----------
    limit : float
        Seconds that it may take; inf if there is no limit.
    share : float
        Part of the work that is done.
    total : int
        Tiles that are expected in all, at least one more than are done.
    """

    limit: float
    share: float = 0.0
    total: int = 0

    def note(self, work: float, done: int, elapsed: float) -> None:
        """Take note of a share of the work, and of the tiles that are done."""
        self.share = max(self.share, share_by(work, elapsed, self.limit))
        expected = round(done / self.share) if self.share > 0 else 0
        most = done * self.total // (done - 1) if done > 1 else expected
        self.total = max(done + 1, min(expected, most))


def usual_prices(plan: RenderPlan) -> dict[str, float]:
    """What rays are expected to cost before any is traced."""
    cost = plan.describe().cost
    return {kind: times * cost.cpu_seconds / cost.camera_rays for kind, times in USUAL.items()}


def kind_of(estimate: Estimate) -> str:
    """Which rays the next pass traces."""
    return PILOTS if estimate.piloted and estimate.state is State.LATTICE else SAMPLES


def rays_of_picture(pixels: int, error: float) -> float:
    """Camera rays of target quality as far as the plan tells: many lie along edges, as long as the side."""
    return max(RAYS_PER_SIDE * sqrt(pixels) / (255 * error), float(pixels))


def measured(prices: Prices, kind: str, seconds: float, rays: float, tiles: int) -> Prices:
    """Prices after a pass: what its rays have cost, and what those are expected to cost that follow."""
    price = seconds / (rays + CALLS * tiles)
    samples = price * USUAL[SAMPLES] / USUAL[kind]
    return {**prices, SAMPLES: samples, kind: price}


def forecast(estimate: Estimate, prices: Prices) -> Forecast:
    """Predict what a picture is going to take, with the next pass decided, or with a part of it done."""
    kind, rays = kind_of(estimate), estimate.work_wanted()
    upcoming = (rays + CALLS) * prices[kind]
    if estimate.state.is_measured:
        # Samples find the unexpected, so that one pass more follows than is planned.
        following = max(_samples_to_come(estimate) - rays, 0.0) + CALLS
        return Forecast(upcoming, following * prices[SAMPLES])
    if estimate.state is State.PROBES:
        return Forecast(upcoming, (AFTER_PROBES - 1) * upcoming)
    price = prices[SAMPLES] / USUAL[SAMPLES]
    return Forecast(upcoming, rays_of_picture(estimate.have.size, estimate.target) * price)


def _samples_to_come(estimate: Estimate) -> float:
    """Those that the allocation predicts, or as many times those so far as the error is to fall.

    The allocation alone predicts errors of 4/255 to 0.03/255 well, but never more than one pass may ask for.
    """
    assert estimate.error is not None
    times = estimate.error.estimate / estimate.target - 1.0
    return max(float(estimate.outlook), times * float(COUNTS[estimate.have].sum()))
