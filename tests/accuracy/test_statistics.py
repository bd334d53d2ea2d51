"""Intervals of predictions, and levels of tests against densities integrated with 50 digits."""

import mpmath
import numpy as np
import pytest

from accuracy.statistics import factor, mean, normal_equivalent
from renderer.math.intervals import Interval, beyond, student
from renderer.math.numerics import EPS

TRIALS = 2000
CHANCE = 4 * np.sqrt(0.05 * 0.95 / TRIALS)
"""Four standard deviations of a share of 95 %: one of 16,000 runs is beyond."""


def share_that_holds(count: int, deviation: float, usual: float) -> float:
    draw = np.random.default_rng(7)
    found = (mean(1 + deviation * draw.standard_normal(count), usual) for _ in range(TRIALS))
    return float(np.mean([known.low <= 1 <= known.high for known in found]))


@pytest.mark.parametrize("count", [1, 2, 5, 30])
@pytest.mark.parametrize("deviation", [0.1, 0.3])
def test_mean_of_few_samples_is_held_often_enough(count: int, deviation: float) -> None:
    assert share_that_holds(count, deviation, usual=0.3) >= 0.95 - CHANCE


def test_mean_of_a_part_leaves_the_variance_of_the_rest() -> None:
    assert mean([1.0, 2.0, 6.0], usual=5.0, covered=1.0) == Interval(3.0, 3.0, 3.0)
    whole, half = (mean([1.0, 2.0, 3.0], usual=0.5, covered=share) for share in (0.0, 0.5))
    assert half.high - half.estimate == pytest.approx((whole.high - whole.estimate) * np.sqrt(0.5), rel=1e-12)


def test_products_add_squared_logarithms() -> None:
    product = Interval(1.0, np.exp(-3), np.exp(3)).times(Interval(2.0, 2 * np.exp(-4), 2 * np.exp(4)))
    assert (product.low, product.high) == pytest.approx((2 * np.exp(-5), 2 * np.exp(5)), rel=1e-12)
    assert Interval(1.0, 0.0, 2.0).times(factor(0.1)).low == 0.0
    assert Interval(0.0, 0.0, 0.0).times(factor(0.1)) == Interval(0.0, 0.0, 0.0)


def test_factor_holds_in_95_of_100_cases() -> None:
    logarithms = 0.4 * np.random.default_rng(3).standard_normal(TRIALS)
    known = factor(0.4)
    held = np.mean((np.log(known.low) <= logarithms) & (logarithms <= np.log(known.high)))
    assert abs(held - 0.95) <= CHANCE


def student_beyond(t: float, freedom: float) -> mpmath.mpf:
    """Probability of |T| > t by the regularised incomplete beta function."""
    nu = mpmath.mpf(freedom)
    return mpmath.betainc(nu / 2, 0.5, 0, nu / (nu + mpmath.mpf(t) ** 2), regularized=True)


@pytest.mark.parametrize("freedom", [1, 2, 3, 10, 51, 64])
def test_student_errs_by_a_few_roundings_a_degree_of_freedom(freedom: int) -> None:
    for t in (0.1, 1.0, 3.5, 8.0):
        assert beyond(t, freedom) == pytest.approx(
            float(student_beyond(t, freedom)), abs=(2 * freedom + 8) * EPS
        )
    assert float(student_beyond(student(freedom, 1e-3), freedom)) == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize("freedom", [3.0, 15.0, 900.0])
@pytest.mark.parametrize("t", [1.0, 3.0, 6.0, 20.0])
def test_t_becomes_the_z_that_is_as_rare(t: float, freedom: float) -> None:
    # 1 - p must keep the digits of a p near 1e-75.
    with mpmath.workdps(120):
        exact = float(mpmath.sqrt(2) * mpmath.erfinv(1 - student_beyond(t, freedom)))
    found = normal_equivalent(np.array([t, t]), np.array([freedom, np.inf]))
    assert found == pytest.approx([exact, t], rel=0.03)
