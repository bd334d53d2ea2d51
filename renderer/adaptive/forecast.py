"""How much of a picture of target quality is done, and what the rest will cost.

The share that is done is that of CPU seconds: those spent, over those and the ones predicted. What the next
pass asks for is known; what others will ask for is predicted from the pilot samples so far, and as soon as
there are samples, from how far the error is above the target. Rays cost what was measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from renderer.adaptive.coverage import border_rays
from renderer.adaptive.early_passes import PROBED, probe_share
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.levels import COUNTS
from renderer.adaptive.neighbours import borders
from renderer.adaptive.rays import of_labels
from renderer.adaptive.states import State
from renderer.plan.plan import RenderPlan

PILOTS, BORDERS, SAMPLES, LAYERS = "pilots", "borders", "samples", "layers"
"""Kinds of rays."""

Prices = Mapping[str, float]
"""CPU seconds of a camera ray by kind."""

USUAL = {PILOTS: 3.0, BORDERS: 0.6, SAMPLES: 2.0, LAYERS: 0.5}
"""Price of a ray over what the plan says of one, until it is measured: medians over the gallery at 128 x 128.
Pilot samples have many light points, layers none."""

UNSURE = 2.75
"""Pilot samples may cost this many times their usual price: on `soft` 8 times what the plan says of a ray."""

GROWTH, MORE = 2.0, 2.0
"""Pilot samples of the next finer lattice for each of this one: twice as many where they follow edges, four
times where all of the lattice is refined."""

OUTLINE = 7
"""Border pixels per pixel of half the picture's perimeter, before any is known: 4 to 14 in the gallery."""

AFTER_PROBES = 4.0
"""Rays of all samples after the probes, over those of the probes: from 0 in large pictures at a coarse error
to 20 in small ones at a fine one, 4 in the median of 19 pictures. Nothing earlier predicts it."""

ONE_MORE, SURPRISES = 1.5, 2.0
"""Rays of all passes after one with samples, over those of that one, at least; and all rays to come over
those that the allocation predicts, as samples find the unexpected. Medians of 90 passes."""

PASSES = 0.06
"""CPU seconds of the passes after the probes, apart from their rays: 3 of 0.02 each in the median. In later
passes the price of a ray includes it."""

TILE_SECONDS, MOST_CALLS = 0.0035, 0.75
"""CPU seconds of a tile of `soft` apart from its rays, and the largest share of a pass that these can be."""

SCATTERED = 16.0
"""Samples of each pixel that shows a mirror, glass, a bent normal or a texture without a mean, as its pilot
sample says little. 14 to 23 in the gallery at 1/255, and 200 where a texture is finer than pixels."""

AFTER_FIRST = 4.0
"""Rays of all samples after a pass, over those of the pass, if a picture begins with samples, as with a
lens."""

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
    return _KINDS.get(estimate.state, SAMPLES)


_KINDS = {State.PREVIEW: PILOTS, State.BORDERS: BORDERS}


def measured_prices(prices: Prices, kind: str, rays: int, seconds: float, tiles: int) -> dict[str, float]:
    """Prices after a pass, from its CPU seconds, rays and tiles; a pass without rays changes none.

    What tiles cost apart from their rays is left out: the more tiles a pass had, the more the next would get.
    """
    if not rays:
        return dict(prices)
    calls = min((tiles - 1) * TILE_SECONDS, MOST_CALLS * seconds)
    return dict(prices) | {kind: (seconds - calls) / rays}


def forecast(estimate: Estimate, prices: Prices) -> Forecast:
    """Predict what a picture is going to take, with the next pass decided."""
    kind, rays = kind_of(estimate), estimate.rays_wanted()
    return Forecast(next=rays * prices[kind], later=sum(_later(estimate, kind, rays, prices)))


def _later(estimate: Estimate, kind: str, rays: int, prices: Prices) -> tuple[float, ...]:
    passes = 0.0 if estimate.state.is_measured else PASSES
    if kind == SAMPLES:
        return passes, _samples_after(estimate, rays) * prices[SAMPLES]
    probes = estimate.have.size * probe_share(estimate) * COUNTS[PROBED]
    sampled = ((1 + AFTER_PROBES) * probes + _scattered(estimate)) * prices[SAMPLES]
    if kind == BORDERS:
        return passes, sampled
    covered = _borders_to_come(estimate) * border_rays(estimate.target) * prices[BORDERS]
    return passes, sampled, covered, _pilots_after(estimate, rays) * prices[PILOTS]


def _samples_after(estimate: Estimate, rays: int) -> float:
    if estimate.state.is_measured:
        return max(SURPRISES * estimate.outlook - rays, ONE_MORE * rays)
    if estimate.adaptive.pilot is None:
        return rays * AFTER_FIRST
    return rays * AFTER_PROBES + _scattered(estimate)


def _scattered(estimate: Estimate) -> float:
    """Samples of the pixels whose pilot samples say little, as far as the lattice so far shows them."""
    if not estimate.have.any():
        return 0.0
    stride, shapes = _known_stride(estimate), estimate.adaptive.unaveraged
    return SCATTERED * stride**2 * float(of_labels(shapes, estimate.labels[::stride, ::stride]).sum())


def _known_stride(estimate: Estimate) -> int:
    """Pixels between the nodes of the finest lattice that is known, before the next pass."""
    return 2 * estimate.stride if estimate.state is State.PREVIEW else estimate.stride


def _pilots_after(estimate: Estimate, rays: int) -> float:
    """Pilot samples on lattices finer than the next one."""
    stride = estimate.stride
    nodes = estimate.have[::stride, ::stride].size
    known = (estimate.have[::stride, ::stride] > 0).sum()
    growth = GROWTH + MORE * rays / max(nodes - known, 1) if known else GROWTH
    return sum(rays * growth**finer for finer in range(1, stride.bit_length()))


def _borders_to_come(estimate: Estimate) -> float:
    """Pixels at borders, as the lattice so far shows them: on a finer one a line has as many more."""
    height, width = estimate.have.shape
    stride = _known_stride(estimate)
    labels = estimate.labels[::stride, ::stride]
    if not estimate.have.any():
        return float(min(OUTLINE * (width + height), width * height))
    return float(min(np.count_nonzero(borders(labels)) * stride, width * height))
