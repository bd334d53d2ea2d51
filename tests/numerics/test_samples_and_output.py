"""Samples and output: what the counts of the hard cases do not say of them."""

import math
from fractions import Fraction

import numpy as np
import pytest

from accuracy.hard_cases.samples_and_output.output import code
from accuracy.hard_cases.samples_and_output.samples import shares, turned, unlikely
from renderer.math.streams import keys
from renderer.samplers import PATTERNS
from schemas.scene import Display


def test_four_of_sixteen_samples_of_a_turned_grid_lie_outside_until_they_are_wrapped() -> None:
    x, y = turned(4)
    outside = (np.minimum(x, y) < 0) | (np.maximum(x, y) >= 1)
    assert outside.sum() == 4
    a, b = PATTERNS["rotated"](keys(0), np.arange(16), 16)
    assert (((a == x) & (b == y)) == ~outside).all()


def test_a_grid_shrunk_to_fit_has_half_the_second_moment_and_a_wrapped_one_nearly_all() -> None:
    """That of an even pixel is 1/12."""
    n = 64
    wrapped, _ = PATTERNS["rotated"](keys(0), np.arange(n * n), n * n)
    shrunk, _ = turned(n, size=math.sqrt(5) / 3)
    moments = [float(np.mean((x - 0.5) ** 2)) * 12 for x in (wrapped, shrunk)]
    # A turned square of side s has s^2 / 12 about any axis, and s is 1 over the sum of cosine and sine.
    assert moments[1] == pytest.approx(5 / 9, abs=1 / n)
    assert 0.85 < moments[0] < 1


@pytest.mark.parametrize(
    ("place", "slope", "share"),
    [(Fraction(-1, 2), 1, 0.5), (Fraction(-1, 8), 0, 0.75), (Fraction(-1, 4), -1, 0.125)],
    ids=["diagonal", "upright", "corner"],
)
def test_the_share_left_of_a_line_is_that_of_its_pixel(place: Fraction, slope: int, share: float) -> None:
    """Pixel (1, 1) of 4 x 4 spans -1/2..0 across and 0..1/2 up."""
    assert shares((place, Fraction(slope)))[1, 1] == share


def test_what_is_unlikely_is_a_tail_of_the_binomial_distribution() -> None:
    # Sixteen times heads has the chance 2^-16, fifteen times or more 17 times that.
    assert unlikely(16, 16, 0.5)
    assert unlikely(0, 16, 0.5)
    assert not unlikely(15, 16, 0.5)


def test_the_exact_code_rounds_to_the_nearest() -> None:
    linear = Display(transfer="linear")
    assert [code(x, linear) for x in (0.5 / 255 - 1e-9, 0.5 / 255 + 1e-9, math.nan)] == [0, 1, 0]
    assert code(1.0, Display()) == 255
