"""What the next pass of an adaptive picture asks for: samples, where they lower the error most.

All decisions are made about the whole picture between passes, so that no pixel depends on tiles.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from renderer.adaptive import strata
from renderer.adaptive.allocation import RAY_PRICE, allocate
from renderer.adaptive.early_passes import (
    PROBED,
    choose_probes,
    cover_borders,
    fine,
    probes,
    raise_probe_probability,
    refine_preview,
)
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.findings import Findings
from renderer.adaptive.lamps import lit
from renderer.adaptive.levels import COUNTS, COVERAGES, HIGHEST, SAMPLED, Levels
from renderer.adaptive.neighbours import spread
from renderer.adaptive.states import State
from renderer.adaptive.uncertainty import standard_errors
from renderer.math.arrays import Floats, Integers, Masks

MARGIN = 0.95
"""Share of the budget for samples and doubts together, as what samples will find is not known exactly."""

EASES = (1.0, 0.7, 0.5, 0.3, 0.1)
"""Shares of the goals, tried in turn until one asks for work: the error was not reached, so the goals were
too high."""

BISECTIONS = 20
"""Bisections of the share of the error that samples aim at: to a millionth."""

DOUBT = 0.2
"""Share of the budget that all strata together may be uncertain by."""

MOSTLY = 0.5
"""If this share of a stratum's pixels are probes, it is sampled as a whole."""

SHOWN = SAMPLED + 3
"""Level of the pixels of such a stratum, 32 samples: they are few, and fewer samples are worse than a pilot
sample."""

CLOSEST = 9
"""Highest level of a probe: 256 samples. If that leaves doubt, more probes are needed."""

FIND = 16.0
"""A probe is a find if its squared error is this many times the target's, and that of its stratum."""

CLEAR = 4.0
"""Standard errors of its own noise that a find must exceed."""

WORTH = 0.01
"""Share of the budget that the pixels a find stands for must err by before its surroundings are searched."""

NEAR = 2
"""Distance in pixels that is searched around a find."""

MANY, MOST_PROBED = 4096, 0.25
"""In a stratum of more pixels than this, at most this share are probes: to probe all would be to sample
all."""

AGAIN = 0.05
"""Share of the budget by which more rays at borders must lower the error."""

RAISED = 2
"""Levels that an uncertain probe and pixels near a find rise by, to four times their samples."""

LEAST_GOAL = 1 / 4
"""Least share of the budget that samples aim at, however uncertain the error is."""

LEAST = 0.1
"""A pass asks for at least this share of all samples so far, or for none: each pass has a cost of its own."""

MOST_ROUNDS = 38
"""Most decisions about samples. More have never been needed, and the loop must end."""


@dataclass(frozen=True, slots=True, eq=False)
class _Borders:
    """Pixels (k,) at borders that rays have covered.

    Attributes
    ----------
    pixels : (k,) int64
    contrasts : (k,) float64
        Scaled so that they explain how exact the shares are in all. What the rays of a single pixel have
        found does not count: those that missed what is thin would get no more. But it does where lights are
        seen, whose outlines are known.
    coverage : (k,) uint8
    """

    pixels: Integers
    contrasts: Floats
    coverage: Levels

    @classmethod
    def of(cls, estimate: Estimate) -> "_Borders":
        """Those of a picture."""
        pixels = np.flatnonzero(estimate.coverage)
        contrasts = estimate.contrasts.ravel()[pixels].astype(np.float64)
        coverage = estimate.coverage.ravel()[pixels]
        found = estimate.spread.ravel()[pixels] * COVERAGES[coverage] ** 1.5
        are_lit = lit(estimate.labels, estimate.adaptive.lamps).ravel()[pixels]
        shares = COVERAGES[coverage] ** -1.5 * ~are_lit
        explained = float((contrasts * shares).sum())
        contrasts *= float((found * shares).sum()) / explained if explained > 0 else 0.0
        np.copyto(contrasts, found, where=are_lit)
        return cls(pixels, contrasts, coverage)

    def rays(self, sizes: Integers) -> float:
        """Camera samples that cost as much as covering them again with other sizes (k,)."""
        return float(RAY_PRICE * COVERAGES[sizes[sizes > self.coverage]].sum())

    def cover_again(self, estimate: Estimate, sizes: Integers) -> None:
        """Ask for more rays, if they lower the error by enough to pay for a pass."""
        gain = self.contrasts * (COVERAGES[self.coverage] ** -1.5 - COVERAGES[sizes] ** -1.5)
        if gain.sum() > AGAIN * estimate.budget:
            estimate.cover.ravel()[self.pixels] = sizes


def advance(estimate: Estimate) -> bool:
    """Decide what the next pass wants, after all tiles of this one; False if the picture is done."""
    estimate.state = TRANSITIONS[estimate.state](estimate)
    return estimate.state is not State.DONE


def _after_pilot_samples(estimate: Estimate) -> State:
    if estimate.stride > 1:
        refine_preview(estimate)
        return State.PREVIEW
    cover_borders(estimate)
    return State.BORDERS


def _after_borders(estimate: Estimate) -> State:
    choose_probes(estimate)
    return State.PROBES


def _after_samples(estimate: Estimate) -> State:
    estimate.rounds += 1
    before = estimate.shown.copy()
    more = _sample_more(estimate)
    # Nothing says yet that the few samples of a probe are better.
    estimate.kept |= estimate.shown & ~before
    return State.SAMPLE if more else State.DONE


TRANSITIONS: dict[State, Callable[[Estimate], State]] = {
    State.PREVIEW: _after_pilot_samples,
    State.BORDERS: _after_borders,
    State.PROBES: _after_samples,
    State.SAMPLE: _after_samples,
}
"""What is decided when a pass is complete; gives the state of the next."""


def _sample_more(estimate: Estimate) -> bool:
    found = estimate.findings()
    estimate.error = sampled = estimate.error_of(found)
    estimate.kept[...] = False
    estimate.want[...] = 0
    estimate.cover[...] = estimate.coverage
    if sampled.bound <= estimate.target:
        return False
    # Only what is shown meanwhile: few probes may leave more doubt about pilot samples than samples have.
    estimate.error = estimate.error_of(estimate.keep(found))
    if estimate.rounds > MOST_ROUNDS:
        return False
    aim_lower(estimate, sampled.bound)
    few = _show_probed(estimate)
    if few.any():
        found = estimate.findings()
    suspect(estimate, found)
    estimate.outlook = _rays_to_come(estimate, found)
    spent = int(COUNTS[estimate.have].sum())
    for ease in EASES:
        _allot(estimate, found, ease)
        _add_probes(estimate, found, ease)
        estimate.want[few] = np.maximum(
            estimate.want[few], np.where(estimate.coverage[few] > 0, PROBED, SHOWN)
        )
        if estimate.rays_wanted() >= LEAST * spent:
            return True
    return bool(estimate.rays_wanted())


def aim_lower(estimate: Estimate, bound: float) -> None:
    """Continue from aims that are reached."""
    before = estimate.aim
    while bound <= estimate.aim:
        estimate.aims += 1
    if estimate.aim < before:
        raise_probe_probability(estimate, strata.typical_error(estimate.strata).astype(np.float32))


def outlook(estimate: Estimate) -> int:
    """Camera rays that all passes to come will ask for, as far as the samples so far predict it.

    It is what the allocation would ask for if no pixel had to rise by steps, and if nothing was in doubt. Few
    samples predict it poorly, so that it is a guess.
    """
    return _rays_to_come(estimate, estimate.so_far())


def _rays_to_come(estimate: Estimate, found: Findings) -> int:
    certain = replace(found.survey, uncertain=np.zeros(strata.COUNT))
    have, borders = estimate.have.ravel()[found.sampled], _Borders.of(estimate)
    goal = MARGIN * estimate.target**2 * estimate.have.size
    allotted = allocate(found.variances, have, certain, goal, borders.contrasts, borders.coverage)
    again = (COUNTS[allotted.pixels] - COUNTS[have]).sum() + (COUNTS[allotted.strata] * certain.sizes).sum()
    return int(again + borders.rays(allotted.covers))


def _allot(estimate: Estimate, found: Findings, ease: float) -> None:
    """Samples where they lower the error most; strata whose pilot sample is not good enough show them."""
    goal = ease * max(_goal(estimate, found), LEAST_GOAL * estimate.budget)
    have, want = estimate.have.ravel(), estimate.want.ravel()
    borders = _Borders.of(estimate)
    allotted = allocate(
        found.variances, have[found.sampled], found.survey, goal, borders.contrasts, borders.coverage
    )
    borders.cover_again(estimate, allotted.covers)
    want[found.sampled] = allotted.pixels
    pilots = np.flatnonzero(~estimate.shown.ravel())
    want[pilots] = levels = allotted.strata[estimate.strata.ravel()[pilots]]
    estimate.shown.ravel()[pilots[levels > 0]] = True


def _goal(estimate: Estimate, found: Findings) -> float:
    """Sum of squared errors whose bound is within the budget.

    The doubt about samples falls with their error; that about pilot samples is what probes will leave of it.
    """
    errors = standard_errors(estimate.confidence)
    own = np.sqrt(max(found.variance - found.survey.variance, 0.0))
    left = min(np.sqrt(found.survey.variance), DOUBT * estimate.budget)
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        share = (low + high) / 2
        over = share * found.total + errors * np.hypot(share * own, left) > MARGIN * estimate.budget
        low, high = (low, share) if over else (share, high)
    return float(low * found.total)


def _add_probes(estimate: Estimate, found: Findings, ease: float) -> None:
    """More of probes whose strata leave the error uncertain: more samples, or more of them."""
    survey = found.survey
    unsure = survey.unsure((ease * DOUBT * estimate.budget) ** 2)
    crowded = unsure & (estimate.probe_probability >= 1)
    estimate.shown |= crowded[estimate.strata]
    most = np.where(survey.sizes > MANY, MOST_PROBED, 1.0)
    noisy = unsure & (survey.noise**2 > survey.uncertain**2 / 2) & (closeness(estimate, found) < CLOSEST)
    have, want, shown = estimate.have.ravel(), estimate.want.ravel(), estimate.shown.ravel()
    again = found.probes[noisy[estimate.strata.ravel()[found.probes]] & ~shown[found.probes]]
    want[again] = np.minimum(have[again] + RAISED, CLOSEST)
    rarer = unsure & ~noisy & (estimate.probe_probability < most)
    estimate.probe_probability[rarer] = np.minimum(2 * estimate.probe_probability, most)[rarer]
    fresh = (probes(estimate) | estimate.shown) & (estimate.have < SAMPLED) & (estimate.want < SAMPLED)
    estimate.want[fresh] = PROBED


def closeness(estimate: Estimate, found: Findings) -> Integers:
    """Least level of the probes of each stratum."""
    levels = np.full(strata.COUNT, HIGHEST)
    np.minimum.at(levels, estimate.strata.ravel()[found.probes], estimate.have.ravel()[found.probes])
    return levels


def suspect(estimate: Estimate, found: Findings) -> None:
    """Sample all pixels near a probe that found what pilot samples had missed.

    They become a stratum of their own, so that what one probe found is not taken to be everywhere.
    """
    kinds = estimate.strata.ravel() // strata.STEPS
    typical = found.survey.errors[estimate.strata.ravel()[found.probes]]
    odd = found.errors > FIND * np.maximum(estimate.aim**2, typical)
    odd &= _matters(
        estimate, found.errors, found.noise, estimate.probe_probability[estimate.strata.ravel()[found.probes]]
    )
    odd &= (kinds[found.probes] <= strata.EVEN) & ~fine(estimate).ravel()[found.probes]
    near = np.zeros(estimate.have.shape, dtype=bool)
    near.ravel()[found.probes[odd]] = True
    near = spread(near, NEAR) & ~estimate.shown
    estimate.strata[near] = estimate.strata[near] % strata.STEPS + strata.STEPS * strata.SUSPECT
    estimate.shown |= near
    estimate.want[near] = np.maximum(estimate.have[near], SAMPLED) + RAISED


def _matters(estimate: Estimate, errors: Floats, noise: Floats, probability: Floats | float) -> Masks:
    """Whether squared errors (n,) exceed noise, and are worth a search around probes of this probability."""
    worth = WORTH * estimate.budget * np.maximum(probability, 2.0**-20)
    return (errors > CLEAR * np.sqrt(noise)) & (errors > worth)


def _show_probed(estimate: Estimate) -> Masks:
    """Show the samples of strata most of whose pixels are probes; gives those (H, W) that it concerns now.

    Few samples rarely see that a pilot sample is wrong; they know their own error better.
    """
    few: Masks = (estimate.probe_probability >= MOSTLY)[estimate.strata] & ~estimate.shown
    estimate.shown |= few
    return few
