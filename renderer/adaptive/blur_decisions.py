"""What the next pass of a picture through a lens asks for: nodes of a lattice, probes, and more samples.

All decisions are made about the whole picture between passes, so that no pixel depends on tiles.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from renderer.adaptive import strata
from renderer.adaptive.allocation import allocate
from renderer.adaptive.between import weights
from renderer.adaptive.blur import (
    choose_probes,
    missing_nodes,
    node_level,
    noise,
    probe_levels,
    refine,
    update,
)
from renderer.adaptive.decisions import (
    EASES,
    LEAST,
    MOST_ROUNDS,
    MOSTLY,
    aim_lower,
    closeness,
    suspect,
)
from renderer.adaptive.early_passes import probes
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.findings import Findings
from renderer.adaptive.levels import COUNTS, SAMPLED
from renderer.adaptive.states import State
from renderer.adaptive.uncertainty import standard_errors
from renderer.math.arrays import Floats

MARGIN = 0.9
"""Share of the budget for noise, doubts and bends together, as what samples will find is not known
exactly."""

LEAST_FOR_ALL, LEAST_FOR_NOISE = 0.6, 0.3
"""Least shares of the budget that doubts leave for noise and bends, and that both leave for noise: probes
cure doubts, and nodes cure bends."""

BENT = 0.3
"""Share of the budget that interpolation may err by before nodes are added where it bends by less."""

STRAIGHTEST = 1 / 4
"""Least share of the aim that bends are compared with."""

UNEXPLAINED, LATER, ROUNDS = 8.0, 2.0, 5
"""A stratum is sampled as a whole if its error is this many times the noise of its nodes, or the second
number after so many rounds: more nodes do not cure what bends do not show, such as things narrower than the
lattice."""

DOUBT = 0.15
"""Share of the budget that all strata together may be uncertain by."""

CLOSEST = 10
"""Highest level of a probe: 512 samples. If that leaves doubt, more probes are needed."""


@dataclass(frozen=True, slots=True, eq=False)
class Shared:
    """Findings as allocation needs them: nodes answer for all that is interpolated between them.

    Attributes
    ----------
    variances : (n,) float64
        Of the sampled pixels, as often as they count.
    survey : Survey
        Without what nodes answer for, and without what more nodes will cure.
    bent : float
        Sum of the squared errors that they will cure.
    """

    variances: Floats
    survey: strata.Survey
    bent: float


def advance(estimate: Estimate) -> bool:
    """Decide what the next pass wants, after all tiles of this one; False if the picture is done."""
    estimate.state = TRANSITIONS[estimate.state](estimate)
    return estimate.state is not State.DONE


def _after_lattice(estimate: Estimate) -> State:
    if estimate.stride > 1:
        refine(estimate)
        return State.LATTICE
    choose_probes(estimate)
    return State.PROBES


def _after_samples(estimate: Estimate) -> State:
    update(estimate)
    estimate.rounds += 1
    return State.SAMPLE if _sample_more(estimate) else State.DONE


TRANSITIONS: dict[State, Callable[[Estimate], State]] = {
    State.LATTICE: _after_lattice,
    State.PROBES: _after_samples,
    State.SAMPLE: _after_samples,
}
"""What is decided when a pass is complete; gives the state of the next."""


def _sample_more(estimate: Estimate) -> bool:
    found = estimate.findings()
    estimate.error = estimate.error_of(found)
    estimate.want[...] = 0
    if estimate.error.bound <= estimate.target or estimate.rounds > MOST_ROUNDS:
        return False
    aim_lower(estimate, estimate.error.bound)
    shared = _shared(estimate, found)
    suspect(estimate, found)
    spent = int(COUNTS[estimate.have].sum())
    for ease in EASES:
        _allot(estimate, found, shared, ease)
        _add_nodes(estimate, shared.bent)
        _add_probes(estimate, found, ease)
        if estimate.rays_wanted() >= LEAST * spent:
            break
    estimate.outlook = estimate.rays_wanted()
    return bool((estimate.want > estimate.have).any())


def _shared(estimate: Estimate, found: Findings) -> Shared:
    between, survey = ~estimate.shown, found.survey
    noises = np.bincount(estimate.strata[between], noise(estimate)[between], minlength=strata.COUNT)
    inherited = noises / np.maximum(survey.sizes, 1)
    own = np.maximum(survey.errors - inherited, 0)
    late = estimate.rounds > ROUNDS
    hidden = survey.errors > (LATER if late else UNEXPLAINED) * inherited
    return Shared(
        variances=found.variances * weights(estimate.ways).ravel()[found.sampled],
        survey=replace(survey, errors=own * hidden),
        bent=float((survey.sizes * own * ~hidden).sum()),
    )


def _allot(estimate: Estimate, found: Findings, shared: Shared, ease: float) -> None:
    """Samples where they lower the error most; strata whose error nodes do not explain are sampled whole."""
    doubt = standard_errors(estimate.confidence) * np.sqrt(found.variance)
    room = max(MARGIN * estimate.budget - doubt, LEAST_FOR_ALL * estimate.budget)
    goal = ease * max(room - shared.bent, LEAST_FOR_NOISE * estimate.budget)
    have, want = estimate.have.ravel(), estimate.want.ravel()
    allotted = allocate(
        shared.variances, have[found.sampled], shared.survey, goal, np.zeros(0), np.zeros(0, np.uint8)
    )
    want[found.sampled] = allotted.pixels
    between = np.flatnonzero(~estimate.shown.ravel())
    levels = allotted.strata[estimate.strata.ravel()[between]]
    between, levels = between[levels > 0], levels[levels > 0]
    want[between] = np.minimum(levels, np.maximum(have[between], node_level(estimate.aim)) + 1)
    estimate.shown.ravel()[between] = True


def _add_nodes(estimate: Estimate, bent: float) -> None:
    """Sample where less noise shows that the picture bends; the closer, the more interpolation errs by."""
    straight = np.sqrt(min(BENT * estimate.budget / bent, 1.0)) if bent > 0 else 1.0
    more = missing_nodes(estimate, max(straight, STRAIGHTEST) * estimate.aim)
    estimate.shown |= more
    level = np.maximum(node_level(estimate.aim), estimate.have[more] + 1)
    estimate.want[more] = np.maximum(estimate.want[more], level)


def _add_probes(estimate: Estimate, found: Findings, ease: float) -> None:
    """More of probes whose strata leave the error uncertain: more samples, or more of them."""
    survey = found.survey
    unsure = survey.unsure((ease * DOUBT * estimate.budget) ** 2)
    crowded = unsure & (estimate.probe_probability >= MOSTLY)
    estimate.shown |= crowded[estimate.strata]
    noisy = unsure & (survey.noise**2 > survey.uncertain**2 / 2) & (closeness(estimate, found) < CLOSEST)
    have, want, shown = estimate.have.ravel(), estimate.want.ravel(), estimate.shown.ravel()
    again = found.probes[noisy[estimate.strata.ravel()[found.probes]] & ~shown[found.probes]]
    want[again] = np.minimum(have[again] + 1, CLOSEST)
    rarer = unsure & ~noisy
    estimate.probe_probability[rarer] = np.minimum(2 * estimate.probe_probability, 1.0)[rarer]
    levels = probe_levels(estimate)
    fresh = probes(estimate) & ~estimate.shown & (estimate.have < SAMPLED)
    estimate.want[fresh] = levels[fresh]
    waiting = estimate.shown & (estimate.have < SAMPLED)
    estimate.want[waiting] = np.maximum(estimate.want[waiting], node_level(estimate.aim))
