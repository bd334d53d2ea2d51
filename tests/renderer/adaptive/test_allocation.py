"""Samples where they lower the error most, against all that might have been done instead."""

import itertools
import math
from statistics import NormalDist

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import camera, scene
from renderer.adaptive import Estimate
from renderer.adaptive.allocation import RAY_PRICE, Allocation, allocate, cover_sizes
from renderer.adaptive.decisions import EASES, LEAP, LEAST, MARGIN, advance
from renderer.adaptive.levels import COUNTS, COVERAGES, HIGHEST, SAMPLED, levels_of
from renderer.adaptive.states import State
from renderer.adaptive.strata import COUNT, Survey
from renderer.adaptive.uncertainty import standard_errors
from schemas.quality import CONFIDENCE, TargetQuality

LEVELS = range(SAMPLED, HIGHEST + 1)
Numbers = NDArray[np.float64]


def surveyed(
    sizes: object = (), errors: object = (), variances: object = (), uncertain: object = 0
) -> Survey:
    """Some strata, the others empty."""
    count = len(np.atleast_1d(np.array(sizes)))
    arrays = {"sizes": np.zeros(COUNT, np.int64)} | {
        name: np.zeros(COUNT) for name in ("errors", "uncertain", "noise", "variances")
    }
    for name, given in (
        ("sizes", sizes),
        ("errors", errors),
        ("variances", variances),
        ("uncertain", uncertain),
    ):
        arrays[name][:count] = given
    return Survey(**arrays)


def variances(*quarters: int) -> Numbers:
    """Variances in the middle of a quarter of an octave, so that the search knows them exactly."""
    return 2.0 ** ((np.array(quarters) + 0.5) / 4)


def left(found: Allocation, single: Numbers, survey: Survey) -> float:
    previewed = np.where(
        found.strata > 0, survey.variances * COUNTS[found.strata].clip(1) ** -1.5, survey.errors
    )
    return float((single * COUNTS[found.pixels] ** -1.5).sum() + (survey.sizes * previewed).sum())


NO_COVERS = np.zeros(0), np.zeros(0, np.uint8)
"""Contrasts and coverage of a picture without borders."""


def spent(found: Allocation, survey: Survey) -> int:
    return int(COUNTS[found.pixels].sum() + (survey.sizes * COUNTS[found.strata]).sum())


def least(errors: list[dict[int, float]], costs: list[dict[int, float]], allowed: float) -> float:
    """The least sum of costs of all combinations whose errors add up to what is allowed."""
    error, cost = np.zeros(1), np.zeros(1)
    for known, price in zip(errors, costs, strict=True):
        error = np.add.outer(error, list(known.values())).ravel()
        cost = np.add.outer(cost, list(price.values())).ravel()
    return float(cost[error <= allowed * (1 + 1e-12)].min())


@pytest.mark.parametrize(
    "quarters", [(-40, -31, -22, -9), (-20, -20, -19, -3), (-60, -8, -7, 0), (5, 5, 5, 5)]
)
@pytest.mark.parametrize("part", [0.3, 0.03, 0.003])
def test_no_other_levels_of_a_few_pixels_do_it_for_much_less(quarters: tuple[int, ...], part: float) -> None:
    """All combinations of levels are tried. A twentieth: the rule for real numbers of samples is rounded."""
    single = variances(*quarters)
    goal = part * float((single * COUNTS[SAMPLED] ** -1.5).sum())
    nothing = surveyed()
    found = allocate(single, np.full(4, SAMPLED, np.uint8), nothing, goal, *NO_COVERS)
    reached = left(found, single, nothing)
    assert reached <= goal
    errors = [{n: float(c) * COUNTS[n] ** -1.5 for n in LEVELS} for c in single]
    costs = [{n: float(COUNTS[n]) for n in LEVELS}] * 4
    assert spent(found, nothing) <= 1.05 * least(errors, costs, reached)


@pytest.mark.parametrize("have", [(3, 10, 3, 13), (6, 6, 6, 6), (17, 3, 3, 3)])
def test_no_pixel_gets_fewer_samples_than_it_has_and_the_others_fewer_for_it(have: tuple[int, ...]) -> None:
    single, nothing = variances(-30, -24, -10, -26), surveyed()
    goal = 0.01 * float(single.sum())
    found = allocate(single, np.array(have, np.uint8), nothing, goal, *NO_COVERS)
    assert (found.pixels >= have).all()
    reached = left(found, single, nothing)
    assert reached <= goal
    errors = [
        {n: float(c) * COUNTS[n] ** -1.5 for n in range(first, HIGHEST + 1)}
        for c, first in zip(single, have, strict=True)
    ]
    costs = [{n: float(COUNTS[n]) for n in range(first, HIGHEST + 1)} for first in have]
    assert spent(found, nothing) <= 1.05 * least(errors, costs, reached)


@pytest.mark.parametrize("part", [0.5, 0.1, 0.01])
def test_strata_and_pixels_share_the_error_at_the_least_cost(part: float) -> None:
    """Every stratum may also keep its pilot samples for nothing."""
    single = variances(-18, -30)
    survey = surveyed([100, 20, 3], [2e-3, 1e-5, 0.05], variances(-30, -12, -16))
    goal = part * (
        left(Allocation(np.full(2, SAMPLED), np.zeros(COUNT, np.int64), NO_COVERS[1]), single, survey)
    )
    found = allocate(single, np.full(2, SAMPLED, np.uint8), survey, goal, *NO_COVERS)
    reached = left(found, single, survey)
    assert reached <= goal
    errors = [{n: float(c) * COUNTS[n] ** -1.5 for n in LEVELS} for c in single]
    costs: list[dict[int, float]] = [{n: float(COUNTS[n]) for n in LEVELS}] * 2
    for size, error, spread in zip(survey.sizes[:3], survey.errors, survey.variances, strict=False):
        errors.append({0: size * error} | {n: size * spread * COUNTS[n] ** -1.5 for n in LEVELS})
        costs.append({0: 0.0} | {n: float(size * COUNTS[n]) for n in LEVELS})
    assert spent(found, survey) <= 1.05 * least(errors, costs, reached)


@pytest.mark.parametrize("goal", [10.0, 1.0, 0.1, 0.01])
def test_many_pixels_reach_the_goal_and_not_much_more(goal: float) -> None:
    """Variances over 20 octaves. The squared error goes with the multiplier to the power -0.6; that is known
    to a twentieth, and pixels of one quarter of an octave change their level together.
    """
    single = variances(*itertools.chain(range(-80, 0), range(-80, 0)))
    found = allocate(single, np.full(160, SAMPLED, np.uint8), surveyed(), goal, *NO_COVERS)
    reached = left(found, single, surveyed())
    assert reached <= goal
    if (found.pixels > SAMPLED).any():
        assert reached >= goal * (1.05 * 2.0**0.25) ** -0.6 * 0.95
    assert (np.diff(found.pixels[:80]) >= 0).all()


def test_pilot_samples_stay_where_they_are_as_good_as_samples() -> None:
    survey = surveyed([1000, 1000], [1e-9, 0.04], [1e-3, 1e-3])
    found = allocate(np.zeros(0), np.zeros(0, np.uint8), survey, 2.0, *NO_COVERS)
    assert found.strata[0] == 0
    assert found.strata[1] >= SAMPLED
    assert not found.strata[2:].any()


def test_what_probes_cannot_distinguish_from_noise_is_not_sampled() -> None:
    survey = surveyed([1000, 10], [0.01, 0.3], [0.5, 0.1], uncertain=[0.01, 0.1])
    found = allocate(np.zeros(0), np.zeros(0, np.uint8), survey, 0.5, *NO_COVERS)
    assert found.strata[0] == 0
    assert found.strata[1] >= SAMPLED


def test_pixels_that_do_not_vary_get_the_fewest_samples() -> None:
    single = np.array([0.0, 0.0, 0.5])
    found = allocate(single, np.full(3, SAMPLED, np.uint8), surveyed(), 1e-3, *NO_COVERS)
    assert found.pixels[:2].tolist() == [SAMPLED, SAMPLED]
    assert 0.5 * COUNTS[found.pixels[2]] ** -1.5 <= 1e-3 * 2.0**0.125


@pytest.mark.parametrize("level", LEVELS)
def test_the_level_of_a_number_of_samples_is_the_one_whose_logarithm_is_nearest(level: int) -> None:
    assert COUNTS[level] == 2 ** (level - 1)
    assert levels_of(COUNTS[level] * 2.0 ** np.array([-0.49, 0, 0.49])).tolist() == [level] * 3
    assert levels_of(np.array([0.0, 1.0, 2.0**40])).tolist() == [SAMPLED, SAMPLED, HIGHEST]


def test_a_goal_out_of_reach_gets_the_most_samples_there_are() -> None:
    found = allocate(np.array([0.5, 1.0]), np.full(2, SAMPLED, np.uint8), surveyed(), 0.0, *NO_COVERS)
    assert found.pixels.tolist() == [HIGHEST, HIGHEST]


SIZES = np.arange(1, COVERAGES.size)
"""Numbers of the coverages."""


def covered(contrasts: Numbers, sizes: NDArray[np.int64]) -> float:
    """Squared error that coverages leave; the pilot sample is worth one ray."""
    return float((contrasts * np.maximum(COVERAGES[sizes], 1) ** -1.5).sum())


@pytest.mark.parametrize("goal", [1.0, 1e-2, 1e-4])
def test_coverages_reach_their_goal_with_fewer_rays_than_equal_ones_would(goal: float) -> None:
    """Contrasts over 20 octaves: the largest ask for the most rays. Of equal coverages, those are compared
    that leave no less error.
    """
    contrasts = variances(*range(-80, 0))
    sizes = cover_sizes(contrasts, goal)
    assert covered(contrasts, sizes) <= goal
    assert (np.diff(sizes) >= 0).all()
    equal = next(size for size in SIZES if covered(contrasts, np.full(80, size)) <= goal)
    assert COVERAGES[sizes].sum() < 80 * COVERAGES[equal]


@pytest.mark.parametrize("goal", [1.0, 1e-2, 1e-4])
def test_no_other_coverages_reach_it_with_much_fewer_rays(goal: float) -> None:
    """Within a twentieth of Lagrange's lower bound: real numbers of rays are rounded to Fibonacci's."""
    contrasts = variances(*range(-80, 0))
    sizes = cover_sizes(contrasts, goal)
    counts, best = np.maximum(COVERAGES, 1).astype(float)[:, None], 0.0
    for price in 2.0 ** np.arange(0, 50, 0.125):
        paid = (COVERAGES[:, None] + price * contrasts * counts**-1.5).min(axis=0).sum()
        best = max(best, float(paid - price * covered(contrasts, sizes)))
    assert COVERAGES[sizes].sum() <= 1.05 * best


def test_without_contrast_no_rays_are_wanted() -> None:
    assert not cover_sizes(np.zeros(5), 1e-6).any()
    assert cover_sizes(np.zeros(0), 1e-6).size == 0


@pytest.mark.parametrize("goal", [1.0, 0.1, 0.01])
def test_samples_and_rays_at_borders_share_the_error_at_the_least_cost(goal: float) -> None:
    """Within a twentieth of Lagrange's lower bound, with a ray at the price of a twelfth of a sample."""
    single, contrasts = variances(*range(-40, 0)), variances(*range(-50, -10))
    have, coverage = np.full(40, SAMPLED, np.uint8), np.ones(40, np.uint8)
    found = allocate(single, have, surveyed(), goal, contrasts, coverage)
    left_now = left(found, single, surveyed()) + covered(contrasts, found.covers)
    assert left_now <= goal
    cost = COUNTS[found.pixels].sum() + RAY_PRICE * COVERAGES[found.covers].sum()
    samples, rays = COUNTS[SAMPLED:].astype(float)[:, None], COVERAGES[1:].astype(float)[:, None]
    best = 0.0
    for price in 2.0 ** np.arange(0, 50, 0.125):
        own = (samples + price * single * samples**-1.5).min(axis=0).sum()
        borders = (RAY_PRICE * rays + price * contrasts * rays**-1.5).min(axis=0).sum()
        best = max(best, float(own + borders - price * left_now))
    assert cost <= 1.05 * best


def test_coverage_only_rises() -> None:
    """Whatever is left to reach, no pixel is covered by fewer rays than it has been."""
    contrasts, coverage = variances(*range(-40, 0)), (np.arange(40) % 20 + 1).astype(np.uint8)
    for goal in (100.0, 1e-2, 1e-5):
        found = allocate(np.zeros(0), np.zeros(0, np.uint8), surveyed(), goal, contrasts, coverage)
        assert (found.covers >= coverage).all()
        if goal == 100.0:
            assert (found.covers == coverage).all()


def bound(single: Numbers, survey: Survey, allowed: float) -> float:
    """What any levels cost that leave no more error than allowed, by Lagrange's duality: a lower bound.

    For any price m of error, each pixel costs at least its least n + m * error; the whole at least the sum of
    these minus m times what is allowed.
    """
    counts = COUNTS[SAMPLED:].astype(float)[:, None]
    best = 0.0
    for price in 2.0 ** np.arange(0, 40, 0.125):
        pixels = (counts + price * single * counts**-1.5).min(axis=0).sum()
        sampled = (counts + price * survey.variances * counts**-1.5).min(axis=0)
        pilots = (survey.sizes * np.minimum(sampled, price * survey.errors)).sum()
        best = max(best, float(pixels + pilots - price * allowed))
    return best


@pytest.mark.parametrize("goal", [1.0, 0.1, 0.01])
def test_no_levels_of_many_pixels_and_strata_do_it_for_much_less(goal: float) -> None:
    """A hundredth: the rule for real numbers of samples is rounded to powers of two."""
    single = variances(*range(-80, 0))
    octaves = np.arange(COUNT)
    survey = surveyed(1 + octaves % 7, 2.0 ** -(4 + octaves % 17), 2.0 ** (-((octaves * 5) % 13) - 3.125))
    found = allocate(single, np.full(80, SAMPLED, np.uint8), survey, goal, *NO_COVERS)
    reached = left(found, single, survey)
    assert reached <= goal
    assert (found.strata == 0).any()
    assert spent(found, survey) <= 1.01 * bound(single, survey, reached)


def noisy_corner(corner: float, elsewhere: float, confidence: float = CONFIDENCE) -> Estimate:
    """Four samples in every pixel; four in a corner, and all others, err by some share of the budget."""
    document = scene(camera=camera(width=48, height=32))
    target = TargetQuality(mode="target", error=4 / 255, confidence=confidence)
    estimate = Estimate.begin(renderer.compile_scene(document, target))
    estimate.state = State.PROBES
    estimate.have[...], estimate.shown[...] = SAMPLED, True
    errors = np.full(estimate.have.shape, elsewhere / (estimate.have.size - 4))
    errors[:2, :2] = corner / 4
    errors *= estimate.budget
    estimate.halves[...] = 0.5 + np.array([1, -1])[:, None, None, None] * np.sqrt(errors)
    estimate.squares[...] = 24 * errors  # single samples vary by eight times as much: four to the power 1.5
    return estimate


def asked(estimate: Estimate, ease: float) -> NDArray[np.int64]:
    """Levels (H, W) that a share of the goal asks for: the doubt about samples is a share of their error."""
    found = estimate.findings()
    assert found.survey.variance == 0
    doubt = standard_errors(CONFIDENCE) * np.sqrt(found.variance) / found.total
    goal = MARGIN * estimate.budget / (1 + doubt)
    have = estimate.have.ravel()
    levels = allocate(found.variances, have, found.survey, ease * goal, *NO_COVERS).pixels
    return np.minimum(levels, SAMPLED + LEAP).reshape(estimate.have.shape)


def test_a_pass_asks_for_a_tenth_of_the_samples_so_far_if_some_share_of_the_goal_does() -> None:
    estimate = noisy_corner(corner=0.7, elsewhere=0.2)
    levels = [asked(estimate, ease) for ease in EASES]
    rays = [int((COUNTS[each] - COUNTS[SAMPLED]).sum()) for each in levels]
    least = LEAST * 4 * estimate.have.size
    enough = next(number for number, count in enumerate(rays) if count >= least)
    assert enough > 0
    assert rays[0] > 0
    assert advance(estimate)
    assert (estimate.want == levels[enough]).all()
    assert estimate.rays_wanted() == rays[enough]


def test_a_pass_asks_for_less_where_no_share_of_the_goal_asks_for_a_tenth() -> None:
    """A corner of 2 x 2 pixels, and those beside it, rise by three levels at most: from 4 to 32 samples."""
    estimate = noisy_corner(corner=0.9, elsewhere=0.0)
    assert LEAST * 4 * estimate.have.size > 28 * 9
    assert advance(estimate)
    assert (estimate.want[:2, :2] > SAMPLED).all()
    assert 0 < estimate.rays_wanted() <= 28 * 9


CONFIDENCES = (0.5, 0.7, 0.95, 0.999)


def test_more_confidence_asks_no_pixel_for_less() -> None:
    """The more of the error may be chance, the less of it samples may leave."""
    wanted = []
    for confidence in CONFIDENCES:
        estimate = noisy_corner(corner=1.2, elsewhere=3.0, confidence=confidence)
        assert advance(estimate)
        wanted.append(estimate.want.copy())
    assert all((more >= less).all() for less, more in itertools.pairwise(wanted))
    assert (wanted[-1] > wanted[0]).any()


@pytest.mark.parametrize("share", [0.6, 0.8, 0.9, 0.99])
def test_a_picture_is_done_when_its_bound_at_the_requested_confidence_keeps_the_target(share: float) -> None:
    """Four equal pixels err by a share s of the budget: the sum varies by 2 s**2 / 4 of its square.

    With c standard errors the bound is s (1 + c / sqrt(2)).
    """
    done = {
        confidence: not advance(noisy_corner(corner=share, elsewhere=0.0, confidence=confidence))
        for confidence in CONFIDENCES
    }
    assert done == {
        confidence: share * (1 + NormalDist().inv_cdf(confidence) / math.sqrt(2)) <= 1
        for confidence in CONFIDENCES
    }
