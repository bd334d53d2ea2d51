"""What probes show about pilot samples of the same stratum."""

import math

import numpy as np
import pytest

from renderer.adaptive import strata
from renderer.adaptive.strata import (
    CERTAIN,
    COUNT,
    STEPS,
    UNSEEN,
    Survey,
)


def survey_of(
    numbers: np.ndarray,
    sizes: np.ndarray,
    errors: np.ndarray,
    spread: np.ndarray,
    variances: np.ndarray,
    expected: float = 1.0,
) -> Survey:
    """What probes show; by default, larger errors were expected than they find."""
    return strata.survey(numbers, sizes, errors, spread, variances, np.full(numbers.size, expected))


@pytest.mark.parametrize("noise", [0.01, 0.3])
@pytest.mark.parametrize("error", [0.0, 0.1])
def test_the_error_of_a_pilot_sample_estimated_by_halves_is_without_bias(noise: float, error: float) -> None:
    """Exponential noise, far from Gaussian; (a - v)(b - v) has variance 2 e e s s + s**4. 5 deviations."""
    random, n = np.random.default_rng(5), 200_000
    a, b = (random.exponential(noise, (2, n)) - noise) + 0.4
    products = (a - (0.4 + error)) * (b - (0.4 + error))
    deviation = math.sqrt((2 * error**2 * noise**2 + noise**4) / n)
    sorts = np.full(n, 3)
    survey = survey_of(sorts, np.bincount(sorts, minlength=COUNT), products, 0 * products, 0 * products)
    assert abs(survey.errors[3] - error**2) <= 5 * deviation
    assert abs(survey.total / n - error**2) <= 5 * deviation
    assert not np.delete(survey.errors, 3).any()


def of_sums() -> tuple[Survey, dict[str, np.ndarray]]:
    random = np.random.default_rng(11)
    probes = {
        "strata": random.choice([0, 7, 50, 119], 200),
        "errors": random.normal(0.01, 0.02, 200),
        "spread": random.random(200) / 1e4,
        "variances": random.random(200),
    }
    sizes = np.zeros(COUNT, np.int64)
    sizes[[0, 7, 50, 60, 119]] = 4000, 300, 70, 9, 1
    return survey_of(
        probes["strata"], sizes, probes["errors"], probes["spread"], probes["variances"]
    ), probes | {"sizes": sizes}


def test_a_survey_has_the_means_of_its_probes_and_sums_over_all_pixels() -> None:
    survey, probes = of_sums()
    total = variance = 0.0
    for stratum in (0, 7, 50, 119):
        of_it = np.flatnonzero(probes["strata"] == stratum)
        errors = [float(probes["errors"][i]) for i in of_it]
        mean = math.fsum(errors) / len(errors)
        # An error of 1 was expected, of which each kind has found far less.
        unseen = CERTAIN * UNSEEN / len(errors)
        uncertain = math.fsum(e * e for e in errors) / len(errors) ** 2 + unseen**2
        assert survey.errors[stratum] == pytest.approx(mean, rel=1e-12)
        assert survey.uncertain[stratum] ** 2 == pytest.approx(uncertain, rel=1e-12)
        noise = math.fsum(probes["spread"][of_it]) / len(errors) ** 2
        assert survey.noise[stratum] ** 2 == pytest.approx(noise, rel=1e-12)
        spread = math.fsum(probes["variances"][of_it]) / len(errors)
        assert survey.variances[stratum] == pytest.approx(spread, rel=1e-12)
        total += int(probes["sizes"][stratum]) * mean
        variance += int(probes["sizes"][stratum]) ** 2 * uncertain
    for stratum in np.flatnonzero(np.bincount(probes["strata"], minlength=COUNT) == 0).tolist():
        expected = float(strata.typical_error(np.array(stratum)))
        total += int(probes["sizes"][stratum]) * expected
        variance += int(probes["sizes"][stratum]) ** 2 * expected**2
    assert survey.total == pytest.approx(total, rel=1e-12)
    assert survey.variance == pytest.approx(variance, rel=1e-12)


def test_the_standard_error_of_a_stratum_covers_what_it_may_be_off_by() -> None:
    """Over 400 surveys of 50 probes each, in 90 of 100 or more: 1.645 standard errors either way.

    No error was expected, so that nothing makes up for what the probes themselves miss.
    """
    random = np.random.default_rng(2)
    sorts, sizes = np.full(50, 2), np.bincount([2], minlength=COUNT)
    inside = 0
    for _ in range(400):
        errors = random.exponential(1.0, 50)
        survey = survey_of(sorts, sizes, errors, 0 * errors, errors, expected=0.0)
        inside += abs(survey.errors[2] - 1) <= 1.645 * survey.uncertain[2]
    assert inside >= 0.9 * 400 - 3 * math.sqrt(400 * 0.9 * 0.1)


@pytest.mark.parametrize("count", [1, 2, 32, 1000])
@pytest.mark.parametrize("expected", [2.0**-30, 2.0**-4])
def test_probes_that_find_nothing_leave_in_doubt_what_the_next_one_may_find(
    count: int, expected: float
) -> None:
    """Powers of two, or their sums, so that means are exact."""
    nothing, sorts = np.zeros(count), np.full(count, 7)
    survey = survey_of(sorts, np.bincount(sorts, minlength=COUNT), nothing, nothing, nothing, expected)
    assert survey.errors[7] == 0
    assert survey.uncertain[7] == CERTAIN * UNSEEN * expected / count
    assert not np.delete(survey.uncertain, 7).any()


@pytest.mark.parametrize(("other", "share"), [(1, 1 / 2), (STEPS, CERTAIN)], ids=["kind", "other kind"])
def test_the_next_probe_may_find_as_much_of_what_is_expected_as_those_of_its_kind_did(
    other: int, share: float
) -> None:
    """Four probes of a stratum find nothing, four of another the expected error. Where both are of one kind,
    and of one size, half of what was expected is found; of another kind nothing is.
    """
    sorts = np.repeat([7, 7 + other], 4)
    sizes, nothing = 100 * np.bincount(sorts, minlength=COUNT), np.zeros(8)
    survey = survey_of(sorts, sizes, np.repeat([0, 1 / 16], 4), nothing, nothing, 1 / 16)
    assert survey.uncertain[7] == share * UNSEEN / 4 / 16


def test_more_found_than_expected_leaves_no_more_in_doubt_than_was_expected() -> None:
    """One probe is in doubt by what it found itself, and by what the next one may find."""
    sorts, nothing = np.array([7]), np.zeros(1)
    survey = survey_of(sorts, np.bincount(sorts, minlength=COUNT), nothing + 1, nothing, nothing, 1 / 4)
    assert survey.uncertain[7] == math.hypot(1, UNSEEN / 4)


@pytest.mark.parametrize("found", [2.0**-6, -(2.0**-6)])
def test_of_what_is_no_more_than_noise_no_more_is_believed_than_was_expected(found: float) -> None:
    """Four probes of variance 1/16: their mean has a standard error of 1/8."""
    four, expected = np.full(4, 1.0), 2.0**-12
    sizes = np.bincount([7], minlength=COUNT)
    survey = survey_of(np.full(4, 7), sizes, found * four, four / 16, four, expected)
    assert survey.noise[7] == 1 / 8
    assert survey.errors[7] == (strata.TRUSTED * expected if found > 0 else 0)
    assert survey.uncertain[7] == strata.TRUSTED * expected
    sure = survey_of(np.full(4, 7), sizes, found * four, 0 * four, four, expected)
    if found > 0:
        assert sure.errors[7] == found
        unseen = UNSEEN * expected / 4
        assert sure.uncertain[7] ** 2 == pytest.approx(found**2 / 4 + unseen**2, rel=1e-15)


@pytest.mark.parametrize("part", [0.0, 0.01, 0.3, 0.9, 1.0])
def test_unsure_are_the_fewest_strata_without_which_the_rest_is_sure_enough(part: float) -> None:
    survey, _ = of_sums()
    variances = (survey.sizes * survey.uncertain) ** 2
    allowed = part * survey.variance * (1 + 2.0**-40)
    unsure = survey.unsure(allowed)
    assert variances[~unsure].sum() <= allowed
    if unsure.any():
        assert variances[~unsure].sum() + variances[unsure].min() > allowed * (1 - 2.0**-40)
        assert variances[unsure].min() >= variances[~unsure].max()
    assert unsure.any() == (part < 1)


@pytest.mark.parametrize(
    ("allowed", "expected"), [(30, []), (29.9, [4]), (14, [4]), (13.9, [3, 4]), (5, [3, 4]), (4.9, [2, 3, 4])]
)
def test_the_strata_of_the_largest_variances_are_unsure(allowed: float, expected: list[int]) -> None:
    """Variances 1, 4, 9 and 16."""
    nothing = np.zeros(COUNT)
    sizes, uncertain = np.zeros(COUNT, np.int64), nothing.copy()
    sizes[[30, 10, 20, 40]], uncertain[[30, 10, 20, 40]] = [1, 1, 3, 2], [1, 2, 1, 2]
    survey = Survey(sizes, nothing, uncertain, nothing, nothing)
    by_root = {1: 30, 2: 10, 3: 20, 4: 40}
    assert set(np.flatnonzero(survey.unsure(allowed)).tolist()) == {by_root[root] for root in expected}
