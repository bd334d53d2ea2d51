"""Mistakes and verdicts of pictures made by hand."""

import numpy as np
import pytest

from accuracy.comparison import Picture
from accuracy.comparison.diagnosis import diagnose
from accuracy.comparison.mistakes import moved


def causes(image: np.ndarray, reference: np.ndarray, tolerance: float = 1e-6) -> list[str]:
    found = diagnose(Picture.of_values(image), Picture.of_values(reference), tolerance, 0.02)
    return [cause.cause for cause in found]


def plain() -> np.ndarray:
    """Bright rectangles on a dark ground, no two sides alike."""
    picture = np.full((40, 48, 3), 0.2)
    picture[6:20, 5:30] = [0.7, 0.4, 0.3]
    picture[25:34, 22:41] = [0.3, 0.6, 0.5]
    return picture


def test_stripes_that_any_smoothing_removes_are_no_shift() -> None:
    """Means of neighbours take them away, and so does the control that moves nothing."""
    stripes = plain() + np.where(np.arange(48) % 2, 0.1, -0.1)[None, :, None]
    assert causes(stripes, plain()) == []


def noisy(picture: np.ndarray, deviation: float) -> np.ndarray:
    return picture + np.random.default_rng(1).normal(0, deviation, picture.shape)


def test_mistake_that_leaves_most_of_the_error_as_noise_is_named() -> None:
    assert causes(noisy(moved(plain(), 1, 0), 0.06), plain(), 0.01)[0] == "one_pixel_right"


def test_shift_of_a_slope_within_the_tolerance_is_not_named() -> None:
    slope = np.repeat(np.add.outer(np.linspace(0, 0.2, 40), np.linspace(0.2, 0.4, 48))[:, :, None], 3, axis=2)
    shifted = noisy(moved(slope, 1, 0), 0.004)
    assert causes(shifted, slope, 0.01) == []
    assert causes(shifted, slope, 0.001) != []


@pytest.mark.parametrize(("right", "down"), [(1, 0), (-1, 0), (0, 1), (0, -1), (1, -1)])
def test_moved_picture_has_pixels_where_they_were_moved(right: int, down: int) -> None:
    picture = np.arange(20).reshape(4, 5)
    found = moved(picture, right, down)
    for row in range(1, 3):
        for column in range(1, 4):
            assert found[row, column] == picture[row - down, column - right]


def test_picture_of_two_pixels_has_no_cause() -> None:
    assert causes(np.zeros((2, 2, 3)), np.ones((2, 2, 3))) == []


def test_equal_and_white_pictures_have_no_cause() -> None:
    assert causes(plain(), plain()) == []
    assert causes(np.ones_like(plain()), plain()) == []


@pytest.mark.parametrize(("side", "named"), [(1, ["antialiasing_missing"]), (2, []), (4, [])])
def test_upright_grid_of_samples_is_antialiasing(side: int, named: list[str]) -> None:
    """Along sides that cover 0.22 of their pixels a grid of 2 x 2 samples shows only one of both colours."""

    def means(points: int) -> np.ndarray:
        y, x = (np.indices((40 * points, 48 * points)) + 0.5) / points
        inside = (x > 5.46) & (x < 30.54) & (y > 8.78) & (y < 25.22)
        shares = inside.reshape(40, points, 48, points).mean(axis=(1, 3))
        return 0.1 + 0.8 * np.repeat(shares[:, :, None], 3, axis=2)

    assert causes(means(side), means(50)) == named
