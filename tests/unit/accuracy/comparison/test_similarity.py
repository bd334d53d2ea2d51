"""SSIM against the paper's formula, window by window."""

import math

import numpy as np
import pytest

from accuracy.comparison.metrics import luma, ssim


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


def test_ssim_of_equal_pictures_is_one() -> None:
    picture = np.random.default_rng(2).random((16, 16))
    assert ssim(picture, picture) == 1.0


def test_ssim_of_flat_pictures_is_that_of_their_means() -> None:
    found = ssim(np.full((12, 12), 0.25), np.full((12, 12), 0.75))
    assert found == pytest.approx((2 * 0.25 * 0.75 + 1e-4) / (0.25**2 + 0.75**2 + 1e-4), rel=1e-11)


def test_a_picture_smaller_than_the_window_has_no_ssim() -> None:
    assert ssim(np.zeros((10, 40)), np.zeros((10, 40))) is None


def test_luma_of_grey_is_its_code_and_that_of_pure_colours_their_weights() -> None:
    grey = np.full((1, 1, 3), 0.2140411)
    assert luma(grey)[0, 0] == pytest.approx(0.5, abs=1e-6)
    colors = np.eye(3).reshape(1, 3, 3)
    assert luma(colors)[0].tolist() == pytest.approx([0.2126, 0.7152, 0.0722], rel=1e-15)
