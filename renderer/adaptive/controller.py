"""What the next pass of a picture asks for. The package's docstring draws how passes follow each other.

All decisions are made about the whole picture between passes, so that no pixel depends on tiles. Where nodes
are sampled, as through a lens, those answer for all that is interpolated between them; pilot samples have no
noise to answer for.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from renderer.adaptive import strata
from renderer.adaptive.allocation import allocate
from renderer.adaptive.estimate import Estimate, State
from renderer.adaptive.findings import Findings, error_of, findings, keep_pilots
from renderer.adaptive.first_passes import (
    MOST_PROBED,
    PROBED,
    choose_probes,
    cover_borders,
    noise,
    probe_levels,
    probes,
    raise_probe_probability,
    refine,
    take_nodes,
)
from renderer.adaptive.lamps import lit
from renderer.adaptive.lattice import interpolate, weights
from renderer.adaptive.levels import COUNTS, COVERAGES, HIGHEST, RAY_PRICE, SAMPLED, Levels, node_level
from renderer.adaptive.uncertainty import standard_errors
from renderer.math.arrays import Floats, Integers, Masks

EASES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
"""Shares of the goals, tried in turn until one asks for work: the error was not reached, so the goals were
too high."""

LEAST = 0.05
"""Share of all samples so far that a pass asks for at least: each has a cost of its own. Without it there are
9 % more passes on 188 random pictures of 48 pixels, with a tenth 2 % more samples."""

DOUBT = 0.2
"""Share of the budget that all strata together may be uncertain by."""

MOSTLY = 0.5
"""If this share of a stratum's pixels are probes, it is sampled as a whole: few samples rarely see that a
pilot sample is wrong, and they know their own error better."""

MANY, MOST_SHARE = 4096, 0.25
"""In a stratum of more pixels than this, at most this share are probes: to probe all would be to sample
all."""

RAISED = 2
"""Levels that an uncertain probe rises by, to four times its samples."""

LEAST_GOAL = 1 / 4
"""Least share of the budget that samples aim at, however uncertain the error is."""

MOST_ROUNDS = 38
"""Most decisions about samples. More have never been needed, and the loop must end."""

UNEXPLAINED = 2.0
"""Through a lens a stratum is sampled as a whole if its error is this many times the noise of its nodes."""


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
        are_lit = lit(estimate.labels, estimate.plan.lamps).ravel()[pixels]
        shares = COVERAGES[coverage] ** -1.5 * ~are_lit
        explained = float((contrasts * shares).sum())
        contrasts *= float((found * shares).sum()) / explained if explained > 0 else 0.0
        np.copyto(contrasts, found, where=are_lit)
        return cls(pixels, contrasts, coverage)

    def rays(self, sizes: Integers) -> float:
        """Camera samples that cost as much as covering them again with other sizes (k,)."""
        return float(RAY_PRICE * COVERAGES[sizes[sizes > self.coverage]].sum())


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """Findings as allocation needs them: nodes answer for all that is interpolated between them.

    Attributes
    ----------
    variances : (n,) float64
        Of the sampled pixels, as often as they count.
    survey : Survey
        Of what more samples of nodes do not cure.
    bent : float
        Sum of the squared errors of interpolation in all other strata.
    """

    variances: Floats
    survey: strata.Survey
    bent: float

    @classmethod
    def of(cls, estimate: Estimate, found: Findings) -> "_Shared":
        """How findings are shared among nodes."""
        if estimate.piloted:
            return cls(found.variances, found.survey, 0.0)
        between, survey = ~estimate.shown, found.survey
        noises = np.bincount(estimate.strata[between], noise(estimate)[between], minlength=strata.COUNT)
        inherited = noises / np.maximum(survey.sizes, 1)
        own = np.maximum(survey.errors - inherited, 0)
        hidden = survey.errors > UNEXPLAINED * inherited
        counted = weights(estimate.ways, estimate.coarsest).ravel()[found.sampled]
        return cls(
            variances=found.variances * counted,
            survey=replace(survey, errors=own * hidden),
            bent=float((survey.sizes * own * ~hidden).sum()),
        )


def advance(estimate: Estimate) -> bool:
    """Decide what the next pass wants, after all tiles of this one; False if the picture is done."""
    estimate.state = TRANSITIONS[estimate.state](estimate)
    return estimate.state is not State.DONE


def _after_lattice(estimate: Estimate) -> State:
    if estimate.stride > 1:
        refine(estimate)
        return State.LATTICE
    take_nodes(estimate)
    if estimate.piloted:
        cover_borders(estimate)
    else:
        interpolate(estimate.values, estimate.ways, estimate.coarsest)
    choose_probes(estimate)
    return State.PROBES


def _after_samples(estimate: Estimate) -> State:
    estimate.rounds += 1
    before = estimate.shown.copy()
    if not estimate.piloted:
        take_nodes(estimate)
        interpolate(estimate.values, estimate.ways, estimate.coarsest)
    more = _sample_more(estimate)
    if estimate.piloted:
        # Nothing says yet that the few samples of a probe are better.
        estimate.kept |= estimate.shown & ~before
    return State.SAMPLE if more else State.DONE


TRANSITIONS: dict[State, Callable[[Estimate], State]] = {
    State.LATTICE: _after_lattice,
    State.PROBES: _after_samples,
    State.SAMPLE: _after_samples,
}
"""What is decided when a pass is complete; gives the state of the next."""


def _sample_more(estimate: Estimate) -> bool:
    found = findings(estimate)
    estimate.error = sampled = error_of(estimate, found)
    estimate.kept[...] = False
    estimate.want[...] = 0
    estimate.cover[...] = estimate.coverage
    if sampled.bound <= estimate.target:
        return False
    # Only what is shown meanwhile: few probes may leave more doubt about pilot samples than samples have.
    estimate.error = error_of(estimate, keep_pilots(estimate, found))
    if estimate.rounds > MOST_ROUNDS:
        return False
    aim_lower(estimate, sampled.bound)
    few = _show_probed(estimate, found)
    if few.any():
        found = findings(estimate)
    shared, borders = _Shared.of(estimate, found), _Borders.of(estimate)
    estimate.outlook = _rays_to_come(estimate, found, shared, borders)
    spent = int(COUNTS[estimate.have].sum())
    for ease in EASES:
        _allot(estimate, found, shared, borders, ease)
        _add_probes(estimate, found, ease)
        _begin_shown(estimate)
        if estimate.rays_wanted() > LEAST * spent:
            break
    return bool(estimate.rays_wanted())


def aim_lower(estimate: Estimate, bound: float) -> None:
    """Continue from aims that are reached."""
    before = estimate.aim
    while bound <= estimate.aim:
        estimate.aims += 1
    if estimate.aim < before:
        expected = strata.typical_error(estimate.strata).astype(np.float32)
        raise_probe_probability(estimate, expected)


def _rays_to_come(estimate: Estimate, found: Findings, shared: _Shared, borders: _Borders) -> int:
    """Camera rays of all passes to come, if no pixel had to rise by steps, and if nothing was in doubt."""
    certain = replace(shared.survey, uncertain=np.zeros(strata.COUNT))
    have = estimate.have.ravel()[found.sampled]
    goal = estimate.target**2 * estimate.have.size
    allotted = allocate(shared.variances, have, certain, goal, borders.contrasts, borders.coverage)
    again = (COUNTS[allotted.pixels] - COUNTS[have]).sum() + (COUNTS[allotted.strata] * certain.sizes).sum()
    return int(again + borders.rays(allotted.covers))


def _allot(estimate: Estimate, found: Findings, shared: _Shared, borders: _Borders, ease: float) -> None:
    """Samples where they lower the error most; strata whose error nodes do not explain are sampled whole."""
    goal = ease * max(_goal(estimate, found) - shared.bent, LEAST_GOAL * estimate.budget)
    have, want = estimate.have.ravel(), estimate.want.ravel()
    allotted = allocate(
        shared.variances, have[found.sampled], shared.survey, goal, borders.contrasts, borders.coverage
    )
    estimate.cover.ravel()[borders.pixels] = allotted.covers
    want[found.sampled] = allotted.pixels
    hidden = np.flatnonzero(~estimate.shown.ravel())
    levels = allotted.strata[estimate.strata.ravel()[hidden]]
    if not estimate.piloted:
        levels = np.minimum(levels, np.maximum(have[hidden], node_level(estimate.aim)) + 1) * (levels > 0)
    want[hidden] = levels
    estimate.shown.ravel()[hidden[levels > 0]] = True


def _goal(estimate: Estimate, found: Findings) -> float:
    """Sum of squared errors whose bound is within the budget: doubts fall as samples' errors do.

    That about pilot samples is for probes to lower.
    """
    own = np.sqrt(max(found.variance - found.survey.variance, 0.0))
    doubt = own / max(found.total / estimate.budget, 1.0)
    return float(estimate.budget - standard_errors(estimate.confidence) * doubt)


def _add_probes(estimate: Estimate, found: Findings, ease: float) -> None:
    """More of probes whose strata leave the error uncertain: more samples, or more of them."""
    survey = found.survey
    unsure = survey.unsure((ease * DOUBT * estimate.budget) ** 2)
    estimate.shown |= (unsure & (estimate.probe_probability >= 1))[estimate.strata]
    noisy = unsure & (survey.noise**2 > survey.uncertain**2 / 2) & (_closeness(estimate, found) < MOST_PROBED)
    have, want, shown = estimate.have.ravel(), estimate.want.ravel(), estimate.shown.ravel()
    again = found.probes[noisy[estimate.strata.ravel()[found.probes]] & ~shown[found.probes]]
    want[again] = np.minimum(have[again] + RAISED, MOST_PROBED)
    most = np.where(survey.sizes > MANY, MOST_SHARE, 1.0)
    rarer = unsure & ~noisy & (estimate.probe_probability < most)
    estimate.probe_probability[rarer] = np.minimum(2 * estimate.probe_probability, most)[rarer]
    fresh = probes(estimate) & ~estimate.shown & (estimate.have < SAMPLED)
    np.copyto(estimate.want, probe_levels(estimate), where=fresh)


def _closeness(estimate: Estimate, found: Findings) -> Integers:
    """Least level of the probes of each stratum."""
    levels = np.full(strata.COUNT, HIGHEST)
    np.minimum.at(levels, estimate.strata.ravel()[found.probes], estimate.have.ravel()[found.probes])
    return levels


def _begin_shown(estimate: Estimate) -> None:
    """Ask for the first samples of pixels that are shown from now on."""
    waiting = estimate.shown & (estimate.have < SAMPLED)
    first = np.where(estimate.coverage[waiting] > 0, PROBED, node_level(estimate.aim))
    estimate.want[waiting] = np.maximum(estimate.want[waiting], first)


def _show_probed(estimate: Estimate, found: Findings) -> Masks:
    """Show the samples of strata most of whose pixels are probes; gives those (H, W) that it concerns now."""
    mostly = estimate.probe_probability >= MOSTLY
    if not estimate.piloted:
        mostly &= found.survey.unsure((DOUBT * estimate.budget) ** 2)
    few: Masks = mostly[estimate.strata] & ~estimate.shown
    estimate.shown |= few
    return few
