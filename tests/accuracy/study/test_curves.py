"""Curves of error against cost."""

from typing import Any

import pytest

from accuracy.study import curves


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


@pytest.mark.parametrize(
    ("rows", "best"),
    [
        ([row(1, 8), row(2, 9), row(3, 4), row(4, 4), row(5, 1)], [0, 2, 4]),
        ([row(1, 8), row(2, 7.9), row(3, 7.0)], [0, 2]),
        ([row(1, 8), row(2, 0.1, known=False)], [0]),
    ],
    ids=["no worse and cheaper", "hardly better", "not distinguished from 0"],
)
def test_front_has_the_settings_that_none_beats(rows: list[dict[str, Any]], best: list[int]) -> None:
    assert curves.front(rows) == [rows[i] for i in best]


def test_curve_through_a_power_law_is_the_law() -> None:
    """Error 8 / t: interpolation in logarithms is exact; beyond its ends nothing is known."""
    line = [row(t, 8 / t) for t in (1, 2, 8)]
    for seconds in (1.0, 1.7, 2.0, 5.0, 8.0):
        assert curves.error_at(line, seconds) == pytest.approx(8 / seconds, rel=1e-12)
        assert curves.cost_at(line, 8 / seconds) == pytest.approx(seconds, rel=1e-12)
        assert curves.cost_at(line, 8 / seconds, curves.rays) == pytest.approx(1000 * seconds, rel=1e-12)
    assert curves.cost_at(line, 9.0) == 1
    assert curves.cost_at(line, 0.9) is curves.error_at(line, 0.9) is curves.error_at(line, 8.1) is None
    assert curves.cost_at([], 1.0) is None


def test_curve_is_unknown_far_from_every_setting() -> None:
    """Two decades lie between the settings: within a factor of two of either they say something."""
    line = [row(1, 10), row(100, 0.1)]
    for wanted in (3.0, 1.0, 0.3):
        assert curves.cost_at(line, wanted) is None
        assert curves.error_at(line, 10 / wanted) is None
    assert curves.cost_at(line, 6.0) == pytest.approx(10 / 6)
    assert curves.error_at(line, 60.0) == pytest.approx(10 / 60)


@pytest.mark.parametrize("power", [-0.5, -0.75, -1.0])
def test_order_of_a_power_law_is_its_power(power: float) -> None:
    order = curves.order([row(t, 3 * t**power) for t in (1, 4, 16, 64)])
    assert order is not None
    assert order.estimate == pytest.approx(power, rel=1e-12)
    halving = curves.halving(order)
    assert halving is not None
    assert halving.estimate == pytest.approx(2 ** (-1 / power), rel=1e-9)
    assert curves.order([row(1, 8), row(2, 4)]) is None
