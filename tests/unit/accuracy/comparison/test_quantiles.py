"""Limits of the tests, against the densities integrated with 50 digits."""

import mpmath
import numpy as np
import pytest

from accuracy.comparison.blocks import shared_out
from accuracy.comparison.variances import normal_equivalent, normal_limit
from renderer.math.intervals import beyond, student
from renderer.math.numerics import EPS


def student_beyond(t: float, freedom: float) -> mpmath.mpf:
    """Probability of |T| > t by the regularised incomplete beta function."""
    nu = mpmath.mpf(freedom)
    return mpmath.betainc(nu / 2, 0.5, 0, nu / (nu + mpmath.mpf(t) ** 2), regularized=True)


@pytest.mark.parametrize("freedom", [1, 2, 3, 10, 51, 64])
@pytest.mark.parametrize("t", [0.1, 1.0, 3.5, 8.0])
def test_probabilities_of_student_err_by_a_few_roundings_for_each_degree_of_freedom(
    t: float, freedom: int
) -> None:
    assert beyond(t, freedom) == pytest.approx(float(student_beyond(t, freedom)), abs=(2 * freedom + 8) * EPS)


@pytest.mark.parametrize("freedom", [1, 5, 51])
def test_the_limit_is_exceeded_with_its_probability(freedom: int) -> None:
    assert float(student_beyond(student(freedom, 1e-3), freedom)) == pytest.approx(1e-3, rel=1e-9)


def test_as_many_tests_as_share_a_level_raise_one_false_alarm_with_it() -> None:
    assert 1 - (1 - shared_out(0.01, 500)) ** 500 == pytest.approx(0.01, rel=1e-12)


def test_normal_limits_are_those_of_the_error_function() -> None:
    for probability in (0.05, 1e-3, 1e-7):
        beyond_limit = mpmath.erfc(normal_limit(probability) / mpmath.sqrt(2))
        assert float(beyond_limit) == pytest.approx(probability, rel=1e-9)


@pytest.mark.parametrize("freedom", [3.0, 15.0, 900.0])
@pytest.mark.parametrize("t", [1.0, 3.0, 6.0, 20.0])
def test_a_t_is_brought_to_the_z_that_is_as_rare(t: float, freedom: float) -> None:
    # 1 - p must keep the digits of a p near 1e-75.
    with mpmath.workdps(120):
        probability = student_beyond(t, freedom)
        exact = float(mpmath.sqrt(2) * mpmath.erfinv(1 - probability))
    found = normal_equivalent(np.array([t]), np.array([freedom]))[0]
    assert found == pytest.approx(exact, rel=0.03)


def test_with_boundless_freedom_a_t_is_a_z() -> None:
    found = normal_equivalent(np.array([5.0]), np.array([np.inf]))[0]
    assert found == pytest.approx(5.0, rel=1e-7)
