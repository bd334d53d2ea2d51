"""Curves of error against cost."""

from __future__ import annotations

from typing import Any

import pytest

from accuracy.study import curves
from accuracy.study.results import at_equal_time


def row(seconds: float, error: float, *, known: bool = True, **more: Any) -> dict[str, Any]:
    value = {"estimate": seconds, "low": seconds, "high": seconds}
    return {
        "name": f"{seconds:g} s",
        "cpu_seconds": value,
        "rays": 1000 * seconds,
        "rmse_255": {"estimate": error, "low": error if known else 0.0, "high": error},
        "resolved": known,
        **more,
    }


def test_a_setting_is_beaten_by_one_that_is_cheaper_and_no_worse() -> None:
    rows = [row(1, 8), row(2, 9), row(3, 4), row(4, 4), row(5, 1)]
    assert curves.front(rows) == [rows[0], rows[2], rows[4]]


def test_a_setting_that_is_hardly_better_is_not_worth_more_time() -> None:
    rows = [row(1, 8), row(2, 7.9), row(3, 7.0)]
    assert curves.front(rows) == [rows[0], rows[2]]


def test_an_error_that_the_reference_cannot_distinguish_from_0_is_on_no_curve() -> None:
    rows = [row(1, 8), row(2, 0.1, known=False)]
    assert curves.front(rows) == rows[:1]


def test_costs_and_errors_on_a_power_law_are_those_of_the_law() -> None:
    """Error 8 / t: interpolation in logarithms is exact."""
    line = [row(t, 8 / t) for t in (1, 2, 8)]
    for seconds in (1.0, 1.7, 2.0, 5.0, 8.0):
        assert curves.error_at(line, seconds) == pytest.approx(8 / seconds, rel=1e-12)
        assert curves.cost_at(line, 8 / seconds) == pytest.approx(seconds, rel=1e-12)
        assert curves.cost_at(line, 8 / seconds, curves.rays) == pytest.approx(1000 * seconds, rel=1e-12)


def test_nothing_is_estimated_beyond_the_ends_of_a_curve() -> None:
    line = [row(1, 8), row(2, 4)]
    assert curves.cost_at(line, 3.9) is None
    assert curves.error_at(line, 0.9) is None
    assert curves.error_at(line, 2.1) is None
    assert curves.cost_at([], 1.0) is None


@pytest.mark.parametrize("wanted", [3.0, 1.0, 0.3])
def test_nothing_is_estimated_far_from_every_measured_error(wanted: float) -> None:
    """Two decades lie between the settings: within a factor of two of either they say something."""
    line = [row(1, 10), row(100, 0.1)]
    assert curves.cost_at(line, wanted) is None
    assert curves.error_at(line, 10 / wanted) is None


def test_errors_within_a_factor_of_two_of_a_measured_one_are_estimated() -> None:
    line = [row(1, 10), row(100, 0.1)]
    assert curves.cost_at(line, 6.0) == pytest.approx(10 / 6)
    assert curves.error_at(line, 60.0) == pytest.approx(10 / 60)


def test_a_larger_error_costs_what_the_cheapest_setting_costs() -> None:
    assert curves.cost_at([row(1, 8), row(2, 4)], 9.0) == 1


@pytest.mark.parametrize("power", [-0.5, -0.75, -1.0])
def test_the_order_of_a_power_law_is_its_power_and_half_the_error_costs_what_it_says(power: float) -> None:
    order = curves.order([row(t, 3 * t**power) for t in (1, 4, 16, 64)])
    assert order is not None
    assert order.estimate == pytest.approx(power, rel=1e-12)
    halving = curves.halving(order)
    assert halving is not None
    assert halving.estimate == pytest.approx(2 ** (-1 / power), rel=1e-9)


def test_two_settings_have_no_order() -> None:
    assert curves.order([row(1, 8), row(2, 4)]) is None


def test_pictures_at_equal_time_are_those_whose_seconds_are_most_alike() -> None:
    settings = [
        row(1, 8, method="uniform", hot=0.0),
        row(4, 4, method="uniform", hot=0.0),
        row(1.5, 8, method="sobol", hot=0.0),
        row(4.2, 2, method="sobol", hot=0.0),
        row(4.1, 1, method="target", hot=0.0),
    ]
    chosen = at_equal_time({"settings": settings})
    assert [one["name"] for one in chosen] == ["4 s", "4.2 s", "4.1 s"]


def test_without_settings_there_are_no_pictures() -> None:
    assert at_equal_time({"settings": []}) == []
