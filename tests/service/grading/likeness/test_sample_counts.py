"""Estimated sample counts of honest pictures, and of pictures made from the reference."""

import io

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import Picture, picture_of
from service.grading.likeness.sample_counts import grain, sample_count
from tests.service.grading.assignments import npy

SIDE = 96
SAMPLES = 1024
COLORS = np.array([0.2, 0.8])
HEIGHTS = [SIDE, 60 * SIDE]
"""The rows of the second are more than are looked at."""


def shares(height: int = SIDE) -> np.ndarray:
    """Of the second colour in each pixel: stripes with soft sides, elsewhere in each row of blocks."""
    rows, columns = np.indices((height, SIDE))
    across = np.abs((columns + rows // 8) % 32 - 15.5)
    return np.clip((12.0 - across) / 4 + 0.1, 0, 1)


def mixed(share: np.ndarray) -> np.ndarray:
    return (COLORS[0] + share * (COLORS[1] - COLORS[0]))[:, :, None].repeat(3, axis=2)


def reference(height: int = SIDE) -> Picture:
    share = shares(height)
    deviation = (COLORS[1] - COLORS[0]) * np.sqrt(share * (1 - share) / SAMPLES)
    layers = {"error": deviation[:, :, None].repeat(3, axis=2), "samples": np.full((height, SIDE), SAMPLES)}
    return picture_of(npy(mixed(share).astype(np.float32)), "reference", "linear", layers)


def eight_bits(linear: np.ndarray) -> Picture:
    buffer = io.BytesIO()
    Image.fromarray(np.rint(255 * np.clip(linear, 0, 1)).astype(np.uint8)).save(buffer, "PNG")
    return picture_of(buffer.getvalue(), "picture.png", "linear")


def honest(samples: int, seed: int, height: int = SIDE) -> Picture:
    drawn = np.random.default_rng(seed).binomial(samples, shares(height))
    return eight_bits(mixed(drawn / samples))


@pytest.mark.parametrize("height", HEIGHTS)
@pytest.mark.parametrize("samples", [1, 4, 16, 64, 256])
def test_slope_is_one_over_the_samples(samples: int, height: int) -> None:
    found = sample_count(honest(samples, samples, height), reference(height))
    assert found is not None
    # Five standard errors: one failure in 2 million.
    assert abs(found.slope - 1 / samples) < 5 * found.error
    assert found.error < 0.1 / samples
    assert not found.suspicious


@pytest.mark.parametrize("height", HEIGHTS)
@pytest.mark.parametrize("deviation", [0.0, 0.004, 0.01])
def test_copy_has_no_slope_whatever_noise_is_added(deviation: float, height: int) -> None:
    noise = np.random.default_rng(1).normal(0, deviation, (height, SIDE, 3))
    found = sample_count(eight_bits(reference(height).linear + noise), reference(height))
    assert found is not None
    assert found.suspicious


def test_grain_is_noise_where_no_sample_varies() -> None:
    noise = np.random.default_rng(2).normal(0, 0.05, (SIDE, SIDE, 3))
    found = grain(eight_bits(reference().linear + noise), reference(), 0.005)
    assert found is not None
    assert 0 < found.grainy == found.blocks
    assert found.suspicious


@pytest.mark.parametrize("samples", [4, 16])
def test_honest_noise_is_no_grain(samples: int) -> None:
    found = grain(honest(samples, 3), reference(), 0.005)
    assert found is not None
    assert found.grainy == 0
    assert not found.suspicious
