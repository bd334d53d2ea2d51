from __future__ import annotations

import pytest

from benchmarks.quotes import Prediction, summary


def prediction(predicted: float, measured: float, *, low: float = 0.0, high: float = 9.0) -> Prediction:
    return Prediction(
        scene="soft",
        quality="sobol 1 x sobol 4",
        mode="fixed",
        predicted=predicted,
        low=low,
        high=high,
        measured=measured,
    )


@pytest.mark.parametrize(("measured", "near"), [(1.5, 1.0), (2.5, 1.0), (1.49, 0.0), (2.51, 0.0)])
def test_a_quarter_more_or_less_is_near(measured: float, near: float) -> None:
    assert summary([prediction(2.0, measured)])["near"] == near


def test_shares_are_those_of_all_predictions() -> None:
    several = [
        prediction(1.0, 1.0),
        prediction(1.0, 3.0),
        prediction(1.0, 1.2, high=1.1),
        prediction(1.0, 0.9, low=0.95),
    ]
    found = summary(several)
    assert (found["predictions"], found["near"], found["held"]) == (4, 0.75, 0.5)
    assert found["median_ratio"] == 1.1


def test_nothing_comes_to_nothing() -> None:
    assert summary([])["predictions"] == 0
