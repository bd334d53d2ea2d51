"""The power law through errors of passes: exact laws, noise, and points through which none goes."""

import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.convergence import NothingToFitError, power_law, trend
from renderer.math.intervals import student

EPS = np.finfo(np.float64).eps
TRIALS = 1000
CHANCE = 4 * math.sqrt(TRIALS * 0.95 * 0.05)
"""Four standard deviations of the number of intervals that hold: one in 30,000 is farther off."""

curves = st.lists(st.floats(1e-3, 1e6), min_size=3, max_size=12, unique=True).filter(
    lambda times: max(times) > 2 * min(times)
)


@settings(max_examples=100)
@given(curves, st.floats(-3.0, 2.0), st.floats(1e-30, 1e30))
def test_power_law_is_found_exactly(times: list[float], order: float, scale: float) -> None:
    t = np.array(times)
    errors = scale * (t / t[0]) ** order
    law = power_law(t, errors)
    # Logarithms of at most 100 are rounded to half an EPS of themselves; the slope is a mean of differences
    # of them over a spread of at least log(2) / 2.
    room = 100 * EPS * t.size / (math.log(2) / 2)
    assert law.order.estimate == pytest.approx(order, abs=room)
    assert law.order.low <= law.order.estimate <= law.order.high
    assert law.at(t) == pytest.approx(errors, rel=100 * EPS + 16 * room)
    if order < -0.1:
        cost = law.falling(float(t.max()))
        assert cost is not None
        # e(t + cost) = e(t) / 2 exactly where (t + cost) / t = 2^(-1 / order).
        assert cost.estimate == pytest.approx(t.max() * (2 ** (-1 / order) - 1), rel=1e-9)


def highs_of(errors: list[float], deviations: list[float]) -> list[float]:
    """Upper ends of intervals of errors whose logarithms have these standard deviations."""
    normal = NormalDist().inv_cdf(0.975)
    return [e * math.sqrt(1 + 2 * normal * d) for e, d in zip(errors, deviations, strict=True)]


@pytest.mark.parametrize("points", [3, 4, 8])
@pytest.mark.parametrize(("intervals", "noise_factor"), [(True, 1.0), (True, 4.0), (False, 1.0)])
def test_interval_holds_in_95_of_100_curves(points: int, intervals: bool, noise_factor: float) -> None:
    """Of the order -0.7 and of the cost of the next error, also where intervals are too narrow by 4."""
    random = np.random.default_rng([points, int(10 * noise_factor), intervals])
    orders = costs = 0
    for _ in range(TRIALS):
        times = np.sort(random.uniform(1, 100, points))
        deviations = random.uniform(0.02, 0.2, points) if intervals else np.full(points, 0.1)
        noise = noise_factor * deviations * random.standard_normal(points)
        errors = 0.3 * times**-0.7 * np.exp(noise)
        law = power_law(times, errors, highs_of(list(errors), list(deviations)) if intervals else None)
        orders += law.order.low <= -0.7 <= law.order.high
        # The error at twice the time, with noise as the last one has; where it rose nothing is claimed.
        further = noise_factor * deviations[-1] * random.standard_normal()
        factor, spent = float(2**0.7 * np.exp(noise[-1] - further)), float(times[-1])
        cost = law.falling(spent, factor) if factor > 1 else None
        costs += cost is None or cost.low <= spent <= cost.high
    assert min(orders, costs) >= 0.95 * TRIALS - CHANCE
    assert intervals or points == 3 or orders <= 0.95 * TRIALS + CHANCE


@pytest.mark.parametrize(
    ("freedom", "half"), [(1, math.tan(0.475 * math.pi)), (2, 0.95 * math.sqrt(2 / (1 - 0.95**2)))]
)
def test_student_interval_has_its_closed_forms(freedom: int, half: float) -> None:
    """Distribution functions that can be inverted: 2 atan(t) / pi, and t / sqrt(2 + t^2)."""
    assert student(freedom) == pytest.approx(half, rel=1e-12)


def test_points_are_weighted_by_their_intervals() -> None:
    """Two pairs of points, each of one time: the line goes through the weighted means of the pairs."""
    errors, deviations = [1.0, math.exp(0.5), math.exp(-1.0), 1.0], [0.01, 0.02, 0.03, 0.01]
    first, second = (0 * 4 + 0.5 * 1) / (4 + 1), (-1.0 * 1 + 0 * 9) / (1 + 9)
    order = power_law([1, 1, math.e, math.e], errors, highs_of(errors, deviations)).order
    assert order.estimate == pytest.approx(second - first, rel=1e-12)
    # On a line intervals leave their own deviation over the root of the sum of x^2 = 2.
    times = [math.exp(-1), 1.0, math.e]
    order = power_law(times, [1 / t for t in times], highs_of([1 / t for t in times], [0.01] * 3)).order
    half = NormalDist().inv_cdf(0.975) * 0.01 / math.sqrt(2)
    assert (order.low, order.high) == pytest.approx((-1 - half, -1 + half), rel=1e-12)


@pytest.mark.parametrize(
    ("times", "errors"),
    [
        ([], []),
        ([1, 2], [0.2, 0.1]),
        ([1, 2, 3], [0.2, 0.1, 0.0]),
        ([0, 2, 3], [0.2, 0.1, 0.05]),
        ([1, 2, 3], [0.2, math.nan, math.inf]),
        ([1, 2, 3], [0.2, -0.1, 0.1]),
        ([2, 2, 2], [0.2, 0.1, 0.05]),
    ],
)
def test_power_law_needs_three_points_at_several_times(times: list[float], errors: list[float]) -> None:
    with pytest.raises(NothingToFitError):
        power_law(times, errors)


def passes(*points: tuple[float, float | None], high: float = 1.01) -> list[dict[str, Any]]:
    return [
        {
            "seconds": 2 * time,
            "cpu_seconds": time,
            "error": error and {"estimate": error, "low": error / high, "high": error * high},
        }
        for time, error in points
    ]


def test_halving_costs_three_times_as_much_again() -> None:
    """Of random samples, whose error falls with the root of the time; passes without an error are ignored."""
    known = passes((0.5, None), (1, 0.1), (4, 0.05), (16, 0.025))
    known[1]["error"]["low"] = 0.0
    found = trend(known)
    assert found["order"]["estimate"] == pytest.approx(-0.5)
    assert found["next_halving"]["cpu_seconds"]["estimate"] == pytest.approx(48)
    assert found["next_halving"]["seconds"]["estimate"] == pytest.approx(96)
    for cost in found["next_halving"].values():
        assert cost["low"] < cost["estimate"] < cost["high"]
    assert found["reason"] is None


@pytest.mark.parametrize("errors", [(0.1, 0.1, 0.1), (0.1, 0.2, 0.4), (0.1, 0.09998, 0.09996)])
def test_halving_has_no_cost_where_the_error_hardly_falls(errors: tuple[float, ...]) -> None:
    found = trend(passes(*zip((1, 10, 100), errors, strict=True)))
    assert found["order"]["estimate"] == pytest.approx(0, abs=1)
    assert found["next_halving"] is None
    assert found["reason"]


def test_halving_may_have_no_upper_end() -> None:
    found = trend(passes((1, 0.1), (2, 0.02), (3, 0.05), (4, 0.03)))
    assert found["order"]["low"] < 0 < found["order"]["high"]
    assert found["next_halving"]["seconds"]["high"] is None
    assert found["reason"]


def test_unknown_errors_keep_the_given_reason() -> None:
    found = trend(passes((1, None), (2, None), (3, None)), "For this.")
    assert found == {"order": None, "next_halving": None, "reason": "For this."}
    assert trend([])["reason"]
