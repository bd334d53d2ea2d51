"""Each metric against its formula: in exact fractions pixel by pixel, SSIM window by window."""

import math
from fractions import Fraction

import numpy as np
import pytest

from accuracy.comparison.metrics import flip, metrics, ssim
from renderer.math.numerics import EPS


@pytest.fixture
def pictures() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    return random.random((7, 9, 3)), random.random((7, 9, 3))


def fractions(picture: np.ndarray) -> list[Fraction]:
    return [Fraction(float(value)) for value in picture.ravel()]


def test_means_of_squares_are_exact(pictures: tuple[np.ndarray, np.ndarray]) -> None:
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


def test_largest_difference_and_share_over_a_limit(pictures: tuple[np.ndarray, np.ndarray]) -> None:
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


def literal_ssim(image: np.ndarray, reference: np.ndarray) -> float:
    """Each window of 11 x 11 pixels with Gaussian weights, as the paper writes it."""
    weights = np.array(
        [[math.exp(-(x * x + y * y) / (2 * 1.5**2)) for x in range(-5, 6)] for y in range(-5, 6)]
    )
    weights /= weights.sum()
    found = []
    for top in range(image.shape[0] - 10):
        for left in range(image.shape[1] - 10):
            a, b = image[top : top + 11, left : left + 11], reference[top : top + 11, left : left + 11]
            mean_a, mean_b = (weights * a).sum(), (weights * b).sum()
            away_a, away_b = a - mean_a, b - mean_b
            square_a, square_b = (weights * away_a**2).sum(), (weights * away_b**2).sum()
            both = (weights * away_a * away_b).sum()
            above = (2 * mean_a * mean_b + 0.0001) * (2 * both + 0.0009)
            found.append(above / ((mean_a**2 + mean_b**2 + 0.0001) * (square_a + square_b + 0.0009)))
    return math.fsum(found) / len(found)


@pytest.mark.parametrize("shape", [(11, 11), (14, 23), (30, 12)])
def test_ssim_is_the_mean_over_all_whole_windows(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(1)
    reference = random.random(shape)
    image = np.clip(reference + 0.2 * random.standard_normal(shape), 0, 1)
    # Variances come from differences of squares near 1 there: some hundred eps over C2 = 9e-4.
    assert ssim(image, reference) == pytest.approx(literal_ssim(image, reference), abs=1e-11)


def test_flip_is_0_for_equal_and_1_from_black_to_white() -> None:
    black, white = np.zeros((64, 64, 3)), np.ones((64, 64, 3))
    assert flip(white, white) == 0.0
    # The authors' own value for black against white is 1 but for the compression near the largest error.
    assert 0.9 < flip(black, white) <= 1.0
    assert flip(0.9 * white, white) < flip(0.5 * white, white)
