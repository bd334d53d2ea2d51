"""The power law through the errors of passes: exact laws, noise, and points through which none goes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.convergence import NothingToFitError, PowerLaw, power_law, trend
from renderer.math.intervals import student

EPS = np.finfo(np.float64).eps

orders = st.floats(-3.0, 2.0)
scales = st.floats(1e-30, 1e30)
curves = st.lists(st.floats(1e-3, 1e6), min_size=3, max_size=12, unique=True).filter(
    lambda times: max(times) > 2 * min(times)
)


def exactly(times: np.ndarray, order: float, scale: float) -> np.ndarray:
    return scale * (times / times[0]) ** order


@settings(max_examples=200, deadline=None)
@given(curves, orders, scales)
def test_exact_power_law(times: list[float], order: float, scale: float) -> None:
    t = np.array(times)
    errors = exactly(t, order, scale)
    law = power_law(t, errors)
    # Logarithms of at most 100 are rounded to half an EPS of themselves; the slope is a mean of differences
    # of them over a spread of at least log(2) / 2.
    room = 100 * EPS * t.size / (math.log(2) / 2)
    assert law.order.estimate == pytest.approx(order, abs=room)
    assert law.order.low <= law.order.estimate <= law.order.high
    assert law.at(t) == pytest.approx(errors, rel=100 * EPS + 16 * room)


@settings(max_examples=100, deadline=None)
@given(curves, st.floats(-3.0, -0.1), scales)
def test_cost_of_half_the_error(times: list[float], order: float, scale: float) -> None:
    t = np.array(times)
    law = power_law(t, exactly(t, order, scale))
    cost = law.falling(float(t.max()))
    assert cost is not None
    # e(t + cost) = e(t) / 2 exactly where (t + cost) / t = 2^(-1 / order).
    assert cost.estimate == pytest.approx(t.max() * (2 ** (-1 / order) - 1), rel=1e-9)
    assert law.at([t.max() + cost.estimate])[0] == pytest.approx(law.at([t.max()])[0] / 2, rel=1e-9)


@settings(max_examples=100, deadline=None)
@given(curves, orders, st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_order_is_free_of_units(times: list[float], order: float, seconds: float, levels: float) -> None:
    t = np.array(times)
    errors = exactly(t, order, 1.0) * np.exp(0.1 * np.sin(np.arange(t.size)))
    highs = errors * (1.1 + 0.1 * np.cos(np.arange(t.size)))
    one = power_law(t, errors, highs).order
    other = power_law(seconds * t, levels * errors, levels * highs).order
    # Logarithms of up to 60 are rounded, their spread is at least log(2) / 2, Student's factor at most 13.
    room = 1000 * 60 * EPS * 13 / (math.log(2) / 2)
    for end in ("estimate", "low", "high"):
        assert getattr(other, end) == pytest.approx(getattr(one, end), abs=room)


def highs_of(errors: list[float], deviations: list[float]) -> list[float]:
    """Upper ends of intervals of errors whose logarithms have these standard deviations."""
    normal = NormalDist().inv_cdf(0.975)
    return [e * math.sqrt(1 + 2 * normal * d) for e, d in zip(errors, deviations, strict=True)]


TRIALS = 2000
MOST = 4 * math.sqrt(TRIALS * 0.95 * 0.05)
"""Four standard deviations of the number of intervals that hold: one in 30,000 is farther off by chance."""


def noisy(points: int, wrong: float, *, with_intervals: bool) -> Iterator[tuple[PowerLaw, float, float]]:
    """Laws through curves of order -0.7 with noise, times of their last points, and their next errors.

    The next error is that at twice the time, with noise as the last one has; both are given by their ratio.
    """
    random = np.random.default_rng([points, int(10 * wrong), with_intervals])
    for _ in range(TRIALS):
        times = np.sort(random.uniform(1, 100, points))
        deviations = random.uniform(0.02, 0.2, points) if with_intervals else np.full(points, 0.1)
        noise = wrong * deviations * random.standard_normal(points)
        errors = 0.3 * times**-0.7 * np.exp(noise)
        highs = highs_of(list(errors), list(deviations))
        law = power_law(times, errors, highs if with_intervals else None)
        further = wrong * deviations[-1] * random.standard_normal()
        yield law, float(times[-1]), float(2**0.7 * np.exp(noise[-1] - further))


KINDS = pytest.mark.parametrize(
    ("with_intervals", "wrong"),
    [(True, 1.0), (True, 4.0), (False, 1.0)],
    ids=["intervals that are right", "intervals a quarter as wide as the noise", "no intervals"],
)


@pytest.mark.parametrize("points", [3, 4, 8])
@KINDS
def test_interval_of_the_order(points: int, with_intervals: bool, wrong: float) -> None:
    orders = [law.order for law, _, _ in noisy(points, wrong, with_intervals=with_intervals)]
    held = sum(order.low <= -0.7 <= order.high for order in orders)
    assert held >= 0.95 * TRIALS - MOST


@pytest.mark.parametrize("points", [3, 4, 8])
@KINDS
def test_interval_of_the_cost(points: int, with_intervals: bool, wrong: float) -> None:
    held = 0
    for law, spent, factor in noisy(points, wrong, with_intervals=with_intervals):
        cost = law.falling(spent, factor) if factor > 1 else None
        # Nothing is claimed where the error did not fall.
        held += cost is None or cost.low <= spent <= cost.high
    assert held >= 0.95 * TRIALS - MOST


@pytest.mark.parametrize(
    ("freedom", "half"), [(1, math.tan(0.475 * math.pi)), (2, 0.95 * math.sqrt(2 / (1 - 0.95**2)))]
)
def test_students_interval(freedom: int, half: float) -> None:
    # Their distribution functions can be inverted: 2 atan(t) / pi, and t / sqrt(2 + t^2).
    assert student(freedom) == pytest.approx(half, rel=1e-12)


def test_weights_of_points() -> None:
    # Two pairs of points, each pair of one time: the line goes through the weighted means of the pairs.
    errors, deviations = [1.0, math.exp(0.5), math.exp(-1.0), 1.0], [0.01, 0.02, 0.03, 0.01]
    first = (0 * 4 + 0.5 * 1) / (4 + 1)
    second = (-1.0 * 1 + 0 * 9) / (1 + 9)
    order = power_law([1, 1, math.e, math.e], errors, highs_of(errors, deviations)).order
    assert order.estimate == pytest.approx(second - first, rel=1e-12)


@pytest.mark.parametrize(
    ("times", "errors", "message"),
    [
        ([], [], "there are 0"),
        ([1, 2], [0.2, 0.1], "there are 2"),
        ([1, 2, 3], [0.2, 0.1, 0.0], "there are 2"),
        ([0, 2, 3], [0.2, 0.1, 0.05], "there are 2"),
        ([1, 2, 3], [0.2, math.nan, math.inf], "there are 1"),
        ([1, 2, 3], [0.2, -0.1, 0.1], "there are 2"),
        ([2, 2, 2], [0.2, 0.1, 0.05], "same time"),
    ],
)
def test_reason_where_nothing_fits(times: list[float], errors: list[float], message: str) -> None:
    with pytest.raises(NothingToFitError, match=message):
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


def test_cost_of_random_samples() -> None:
    found = trend(passes((0.5, None), (1, 0.1), (4, 0.05), (16, 0.025)))
    assert found["order"]["estimate"] == pytest.approx(-0.5)
    assert found["next_halving"]["cpu_seconds"]["estimate"] == pytest.approx(48)
    assert found["next_halving"]["seconds"]["estimate"] == pytest.approx(96)
    for cost in found["next_halving"].values():
        assert cost["low"] < cost["estimate"] < cost["high"]
    assert found["reason"] is None


@pytest.mark.parametrize("errors", [(0.1, 0.1, 0.1), (0.1, 0.2, 0.4)], ids=["level", "rising"])
def test_error_that_does_not_fall(errors: tuple[float, ...]) -> None:
    found = trend(passes(*zip((1, 4, 16), errors, strict=True)))
    assert found["order"]["estimate"] >= 0
    assert found["next_halving"] is None
    assert found["reason"] == "The error does not fall from pass to pass."


def test_unbounded_cost_has_a_reason() -> None:
    found = trend(passes((1, 0.1), (2, 0.02), (3, 0.05), (4, 0.03)))
    assert found["order"]["low"] < 0 < found["order"]["high"]
    assert found["next_halving"]["seconds"]["high"] is None
    assert "power law" in found["reason"]
