"""Each metric against the same formula in exact fractions, pixel by pixel."""

import math
from fractions import Fraction

import numpy as np
import pytest

from accuracy.comparison.metrics import metrics
from renderer.math.numerics import EPS


@pytest.fixture
def pictures() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    return random.random((7, 9, 3)), random.random((7, 9, 3))


def fractions(picture: np.ndarray) -> list[Fraction]:
    return [Fraction(float(value)) for value in picture.ravel()]


def test_means_of_squares_are_those_of_exact_fractions(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    image, reference = pictures
    found = metrics(image, reference, 0.5)
    pairs = list(zip(fractions(image), fractions(reference), strict=True))
    mse = sum((a - b) ** 2 for a, b in pairs) / len(pairs)
    relative = sum((a - b) ** 2 / (b**2 + Fraction(1, 100)) for a, b in pairs) / len(pairs)
    # Some hundred terms of one sign, each with a handful of roundings.
    assert found.mse == pytest.approx(float(mse), rel=32 * EPS)
    assert found.relmse == pytest.approx(float(relative), rel=32 * EPS)
    assert found.rmse == pytest.approx(math.sqrt(mse), rel=32 * EPS)
    assert found.psnr == pytest.approx(-10 * math.log10(mse), rel=32 * EPS)


def test_the_largest_difference_and_the_share_over_a_limit_are_counted_one_by_one(
    pictures: tuple[np.ndarray, np.ndarray],
) -> None:
    image, reference = pictures
    over = sum(
        any(abs(image[y, x, c] - reference[y, x, c]) > 0.5 for c in range(3))
        for y in range(7)
        for x in range(9)
    )
    found = metrics(image, reference, 0.5)
    assert 0 < over < 63
    assert found.frac_over == over / 63
    assert found.max_abs == max(abs(float(a - b)) for a, b in zip(image.flat, reference.flat, strict=True))


def test_equal_pictures_are_not_apart_at_all() -> None:
    picture = np.full((4, 4, 3), 0.3)
    found = metrics(picture, picture, 0.0)
    assert (found.mse, found.psnr, found.relmse, found.max_abs, found.frac_over) == (0, math.inf, 0, 0, 0)


@pytest.mark.parametrize(("difference", "share"), [(0.1, 0.0), (0.1 + 1e-12, 1.0)])
def test_a_difference_exactly_on_the_limit_is_not_over_it(difference: float, share: float) -> None:
    """0.7 - 0.6 is 0.09999999999999998 and 0.4 - 0.3 is 0.10000000000000003: neither is over 0.1."""
    for base in (0.3, 0.6):
        image, reference = np.full((2, 2, 3), base + difference), np.full((2, 2, 3), base)
        assert metrics(image, reference, 0.1).frac_over == share
