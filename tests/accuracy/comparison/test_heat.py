"""Pictures of differences of which the answer is known."""

import numpy as np
import pytest

from accuracy.comparison import Picture, heat
from renderer.images.colors import linear_from_srgb


def linear(code: float) -> Picture:
    return Picture.of_values(np.full((3, 5, 3), linear_from_srgb(np.array(code)), np.float64))


@pytest.mark.parametrize(
    ("difference", "color"),
    [(0.0, [0, 0, 0]), (0.0625, [90, 0, 120]), (0.25, [255, 255, 255]), (0.5, [255, 255, 255])],
)
def test_heat_of_a_difference_is_absolute(difference: float, color: list[int]) -> None:
    drawn = heat.heat_map(linear(0.25 + difference), linear(0.25))
    assert drawn.shape == (3, 5, 3)
    assert drawn[1, 2].tolist() == color


def test_side_by_side_shows_picture_reference_and_map() -> None:
    drawn = heat.side_by_side(linear(1.0), linear(0.0))
    assert drawn.shape == (3, 3 * 5 + 8, 3)
    assert drawn[0, 0].tolist() == [255] * 3
    assert drawn[0, 5].tolist() == [128] * 3
    assert drawn[0, 9].tolist() == [0] * 3
    assert drawn[0, 18].tolist() == [255] * 3
