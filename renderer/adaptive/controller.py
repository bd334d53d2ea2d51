"""Decisions between the passes of a picture: what the next one requests. The package's docstring draws them.

Each decision is made for the whole picture, so that no pixel depends on tiles. Pilot samples have no noise;
the sampled nodes of a lens do, and it enters the error of every pixel interpolated from them.
"""

from dataclasses import replace

import numpy as np

from renderer.adaptive import strata
from renderer.adaptive.allocation import COVERAGE_DECAY, ReducibleErrors, allocate
from renderer.adaptive.error_statistics import ErrorStatistics, error_of, error_statistics
from renderer.adaptive.estimate import Estimate, State
from renderer.adaptive.first_passes import (
    FIRST_PROBE_LEVEL,
    MAX_PROBE_LEVEL,
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
from renderer.adaptive.lattice import weights
from renderer.adaptive.levels import COUNTS, COVERAGES, HIGHEST, RAY_PRICE, SAMPLED, Levels, node_level
from renderer.adaptive.uncertainty import standard_errors
from renderer.math.arrays import Floats, Integers, Masks

BACKOFF = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
"""Factors on the goal, tried in turn until one requests work: the last goal was reached and did not
suffice."""

MIN_PASS_SHARE = 0.05
"""Least samples of a pass, as a share of all so far: each pass has a fixed cost. Without it there are 9 %
more passes on 188 random pictures of 48 pixels; with a tenth, 2 % more samples."""

PROBE_VARIANCE_SHARE = 0.2
"""Share of the budget that the strata's errors may be uncertain by in all."""

SAMPLE_WHOLE_STRATUM = 0.5
"""Share of probes from which on a whole stratum is sampled: few samples rarely reveal that a pilot sample is
wrong, and they estimate their own error better."""

LARGE_STRATUM, MAX_LARGE_STRATUM_PROBES = 4096, 0.25
"""Pixels of a large stratum, and its largest share of probes: more would amount to sampling it whole."""

PROBE_LEVEL_STEP = 2
"""Levels by which an uncertain probe rises: four times its samples."""

MIN_GOAL_SHARE = 1 / 4
"""Least share of the budget that samples aim for, however uncertain the error is."""

UNEXPLAINED_ERROR_RATIO = 2.0
"""Error of an interpolated stratum over the noise of its nodes from which on more samples of the nodes do not
help, so that the stratum itself is sampled."""


def advance(estimate: Estimate) -> bool:
    """Decide what the next pass requests, after all tiles of this one; False if the picture is done."""
    decide = _after_lattice if estimate.state is State.LATTICE else _after_samples
    estimate.state = decide(estimate)
    return estimate.state is not State.DONE


def _after_lattice(estimate: Estimate) -> State:
    if estimate.stride > 1:
        refine(estimate)
        return State.LATTICE
    take_nodes(estimate)
    if estimate.piloted:
        cover_borders(estimate)
    choose_probes(estimate)
    found = error_statistics(estimate)
    errors, interpolation = _reducible(estimate, found)
    goal = _sampling_goal(estimate, found, interpolation)
    estimate.predicted_rays = int(_predicted_rays(estimate, found, errors, goal))
    return State.PROBES


def _after_samples(estimate: Estimate) -> State:
    take_nodes(estimate)
    return State.SAMPLE if _sample_more(estimate) else State.DONE


def _sample_more(estimate: Estimate) -> bool:
    found = error_statistics(estimate)
    estimate.error = error_of(estimate, found)
    estimate.want[...] = 0
    estimate.cover[...] = estimate.coverage
    if estimate.error.bound <= estimate.target:
        return False
    lower_aim(estimate, estimate.error.bound)
    if _sample_probed_strata(estimate, found):
        found = error_statistics(estimate)
    errors, interpolation = _reducible(estimate, found)
    least, goal = MIN_PASS_SHARE * COUNTS[estimate.have].sum(), _sampling_goal(estimate, found, interpolation)
    predicted = _predicted_rays(estimate, found, errors, goal)
    for backoff in BACKOFF:
        _allocate(estimate, found, errors, backoff * goal)
        _add_probes(estimate, found, backoff)
        _begin_shown(estimate)
        if estimate.rays_wanted() > least:
            break
    # Samples reveal more error, so that one pass more follows than is planned.
    estimate.predicted_rays = int(max(predicted, estimate.work_wanted()) + least)
    return bool(estimate.rays_wanted())


def _reducible(estimate: Estimate, found: ErrorStatistics) -> tuple[ReducibleErrors, float]:
    """Errors with those of interpolated pixels attributed to their nodes, and the sum of what is left there.

    What noise of the nodes explains is theirs; what is much larger is removed only by sampling the stratum.
    """
    variances, measured, interpolation = found.variances, found.strata, 0.0
    if not estimate.piloted:
        between = ~estimate.shown
        noises = np.bincount(estimate.strata[between], noise(estimate)[between], minlength=strata.COUNT)
        inherited = noises / np.maximum(measured.sizes, 1)
        own = np.maximum(measured.errors - inherited, 0)
        hidden = measured.errors > UNEXPLAINED_ERROR_RATIO * inherited
        variances = variances * weights(estimate.axes, estimate.coarsest).ravel()[found.sampled]
        interpolation = float((measured.sizes * own * ~hidden).sum())
        measured = replace(measured, errors=own * hidden)
    levels = estimate.have.ravel()[found.sampled]
    return ReducibleErrors(variances, levels, measured, *_border_contrasts(estimate)), interpolation


def _border_contrasts(estimate: Estimate) -> tuple[Floats, Levels]:
    """Variances (k,) of single rays at borders, scaled to explain the total measured one, and coverages.

    A pixel's own measured variance is used only where lights are visible, whose outlines are known: a pixel
    whose rays missed something thin would otherwise get no more rays.
    """
    pixels = np.flatnonzero(estimate.coverage)
    contrasts = estimate.contrasts.ravel()[pixels].astype(np.float64)
    coverage = estimate.coverage.ravel()[pixels]
    measured = estimate.coverage_variance.ravel()[pixels] * COVERAGES[coverage] ** COVERAGE_DECAY
    are_lit = lit(estimate.labels, estimate.plan.lamps).ravel()[pixels]
    shares = COVERAGES[coverage] ** -COVERAGE_DECAY * ~are_lit
    explained = float((contrasts * shares).sum())
    contrasts *= float((measured * shares).sum()) / explained if explained > 0 else 0.0
    np.copyto(contrasts, measured, where=are_lit)
    return contrasts, coverage


def lower_aim(estimate: Estimate, bound: float) -> None:
    """Replace aims that have been reached by finer ones."""
    before = estimate.aim
    while bound <= estimate.aim:
        estimate.aims += 1
    if estimate.aim < before:
        expected = strata.typical_error(estimate.strata).astype(np.float32)
        raise_probe_probability(estimate, expected)


def _predicted_rays(
    estimate: Estimate, found: ErrorStatistics, errors: ReducibleErrors, goal: float
) -> float:
    """Camera rays of all passes to come, if every stratum's error were certain."""
    goal *= (estimate.target / estimate.aim) ** 2
    certain = replace(errors.strata, uncertain=np.zeros(strata.COUNT))
    pixels, levels, covers = allocate(replace(errors, strata=certain), goal)
    again = (COUNTS[pixels] - COUNTS[errors.levels]).sum() + (COUNTS[levels] * certain.sizes).sum()
    rays = float(again + RAY_PRICE * COVERAGES[covers[covers > errors.coverage]].sum())
    if estimate.piloted:
        return rays
    # Edges are blurred: errors fall as slowly as those of independent samples in some pixels, and as fast as
    # the allocation assumes in others.
    slow = float(COUNTS[estimate.have].sum()) * max(found.total / goal - 1.0, 0.0)
    return float(np.sqrt(rays * slow))


def _allocate(estimate: Estimate, found: ErrorStatistics, errors: ReducibleErrors, goal: float) -> None:
    """Request samples where they reduce the error most; whole strata where nodes do not explain it."""
    have, want = estimate.have.ravel(), estimate.want.ravel()
    want[found.sampled], of_strata, covers = allocate(errors, goal)
    estimate.cover[estimate.coverage > 0] = covers
    hidden = np.flatnonzero(~estimate.shown.ravel())
    levels = of_strata[estimate.strata.ravel()[hidden]]
    if not estimate.piloted:
        levels = np.minimum(levels, np.maximum(have[hidden], node_level(estimate.aim)) + 1) * (levels > 0)
    want[hidden] = levels
    estimate.shown.ravel()[hidden[levels > 0]] = True


def _sampling_goal(estimate: Estimate, found: ErrorStatistics, interpolation: float) -> float:
    """Sum of squared errors whose upper bound is the budget, if its uncertainty falls as the error does.

    The error of interpolation is subtracted. The uncertainty of pilot samples is left out: probes reduce it.
    """
    own = np.sqrt(max(found.variance - found.strata.variance, 0.0))
    doubt = own / max(found.total / estimate.budget, 1.0)
    goal = estimate.budget - standard_errors(estimate.confidence) * doubt - interpolation
    return float(max(goal, MIN_GOAL_SHARE * estimate.budget))


def _add_probes(estimate: Estimate, found: ErrorStatistics, backoff: float) -> None:
    """Reduce the uncertainty of strata: by more samples of their probes, or by more probes."""
    measured = found.strata
    unsure = measured.unsure((backoff * PROBE_VARIANCE_SHARE * estimate.budget) ** 2)
    estimate.shown |= (unsure & (estimate.probe_probability >= 1))[estimate.strata]
    noisy = unsure & (measured.noise**2 > measured.uncertain**2 / 2)
    noisy &= _least_probe_level(estimate, found) < MAX_PROBE_LEVEL
    have, want, shown = estimate.have.ravel(), estimate.want.ravel(), estimate.shown.ravel()
    again = found.probes[noisy[estimate.strata.ravel()[found.probes]] & ~shown[found.probes]]
    want[again] = np.minimum(have[again] + PROBE_LEVEL_STEP, MAX_PROBE_LEVEL)
    most = np.where(measured.sizes > LARGE_STRATUM, MAX_LARGE_STRATUM_PROBES, 1.0)
    rarer = unsure & ~noisy & (estimate.probe_probability < most)
    estimate.probe_probability[rarer] = np.minimum(2 * estimate.probe_probability, most)[rarer]
    fresh = probes(estimate) & ~estimate.shown & (estimate.have < SAMPLED)
    np.copyto(estimate.want, probe_levels(estimate), where=fresh)


def _least_probe_level(estimate: Estimate, found: ErrorStatistics) -> Integers:
    """Least level of the probes of each stratum."""
    levels = np.full(strata.COUNT, HIGHEST)
    np.minimum.at(levels, estimate.strata.ravel()[found.probes], estimate.have.ravel()[found.probes])
    return levels


def _begin_shown(estimate: Estimate) -> None:
    """Request the first samples of pixels that have just been chosen to show samples."""
    waiting = estimate.shown & (estimate.have < SAMPLED)
    first = np.where(estimate.coverage[waiting] > 0, FIRST_PROBE_LEVEL, node_level(estimate.aim))
    estimate.want[waiting] = np.maximum(estimate.want[waiting], first)


def _sample_probed_strata(estimate: Estimate, found: ErrorStatistics) -> bool:
    """Show samples in all strata that consist mostly of probes; whether any pixel is new among them."""
    mostly = estimate.probe_probability >= SAMPLE_WHOLE_STRATUM
    if not estimate.piloted:
        mostly &= found.strata.unsure((PROBE_VARIANCE_SHARE * estimate.budget) ** 2)
    fresh: Masks = mostly[estimate.strata] & ~estimate.shown
    estimate.shown |= fresh
    return bool(fresh.any())
