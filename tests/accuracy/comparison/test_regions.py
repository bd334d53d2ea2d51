"""Regions of pictures with known differences."""

import numpy as np
import pytest

from accuracy.comparison.regions import Region, named, squares_of, worst


def everything(difference: np.ndarray) -> np.ndarray:
    """No block is left out."""
    return np.ones((-(-difference.shape[0] // 8), -(-difference.shape[1] // 8)), bool)


def found(difference: np.ndarray, suspects: np.ndarray, shapes: np.ndarray | None) -> tuple[Region, ...]:
    return worst(difference, squares_of(difference), suspects, shapes)


def test_regions_are_touching_blocks_worst_first() -> None:
    difference = np.zeros((64, 64, 3))
    difference[8:24, 16:24] = -0.5
    difference[40:48, 40:48] = 0.6
    first, second = found(difference, everything(difference), None)
    assert (first.x0, first.y0, first.x1, first.y1) == (16, 8, 24, 24)
    assert (second.x0, second.y0, second.x1, second.y1) == (40, 40, 48, 48)
    assert first.share + second.share == pytest.approx(1.0)
    assert first.share == pytest.approx(128 * 0.25 / (128 * 0.25 + 64 * 0.36))
    assert (first.brightness, second.brightness) == pytest.approx((-0.5, 0.6))
    assert first.rmse == pytest.approx(0.5)
    assert first.shape is None


def test_region_has_the_name_of_its_shape() -> None:
    shapes = np.zeros((16, 16), np.int32)
    shapes[2:4, 2:4] = 2
    difference = np.full((16, 16, 3), 0.001)
    difference[2:4, 2:4] = 0.3
    (region,) = found(difference, everything(difference), shapes)
    assert region.shape == 2
    assert named(region.shape, ["floor", "wall", "ball"]) == "ball"
    assert named(-1, []) == "background"
    assert named(None, []) is None


def test_region_is_only_where_noise_is_no_reason() -> None:
    difference = np.random.default_rng(1).normal(0.0, 0.2, (32, 32, 3))
    difference[8:16, 16:24] += 0.1
    suspects = np.zeros((4, 4), bool)
    suspects[1, 2] = True
    (region,) = found(difference, suspects, None)
    assert (region.x0, region.y0, region.x1, region.y1) == (16, 8, 24, 16)


def test_equal_pictures_have_no_region() -> None:
    difference = np.zeros((9, 9, 3))
    assert found(difference, everything(difference), None) == ()
