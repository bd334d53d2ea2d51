"""The error of a picture as it is reported."""

import math

import numpy as np
import pytest

from renderer.adaptive.uncertainty import error_of


def test_error_is_the_root_mean_square() -> None:
    error = error_of(total=4.0, variance=0.0, pixels=100)
    assert error.estimate == error.low == error.high == error.bound == 0.2


def test_interval_holds_in_95_of_100_cases() -> None:
    """Both sides, and one: Phi(1.96) = 0.975 and Phi(1.645) = 0.95."""
    error = error_of(total=4.0, variance=0.25, pixels=100)
    beyond = (error.high**2 * 100 - 4) / 0.5
    assert math.erfc(beyond / math.sqrt(2)) == pytest.approx(0.05, abs=1e-4)
    assert (4 - error.low**2 * 100) / 0.5 == pytest.approx(beyond, rel=1e-12)
    beyond = (error.bound**2 * 100 - 4) / 0.5
    assert math.erfc(beyond / math.sqrt(2)) / 2 == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize("confidence", [0.5, 0.8, 0.95, 0.999])
def test_bound_holds_at_its_confidence(confidence: float) -> None:
    error = error_of(total=4.0, variance=0.25, pixels=100, confidence=confidence)
    beyond = (error.bound**2 * 100 - 4) / 0.5
    assert math.erfc(beyond / math.sqrt(2)) / 2 == pytest.approx(1 - confidence, rel=1e-9)


def test_negative_sum_is_no_error() -> None:
    error = error_of(total=-1.0, variance=1.0, pixels=10)
    assert (error.estimate, error.low) == (0, 0)
    assert error.bound > 0
    assert np.isfinite(list(error.document().values())).all()
    assert error.document().keys() == {"estimate", "low", "high"}
