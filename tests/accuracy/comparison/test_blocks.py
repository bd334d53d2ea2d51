"""Blocks and their trimmed t, against the same computed number by number."""

import statistics

import numpy as np
import pytest

from accuracy.comparison.blocks import bias, gathered, limit, starts
from renderer.math.numerics import EPS


def literal_ratio(values: list[float], allowed: float) -> float:
    """|t| over its limit: the mean without a tenth at each end, and the winsorised deviation."""
    ordered, cut = sorted(values), len(values) // 10
    kept = ordered[cut : len(values) - cut]
    mean = statistics.fmean(kept)
    winsorised = [kept[0]] * cut + kept + [kept[-1]] * cut
    error = statistics.stdev(winsorised) * len(values) ** 0.5 / len(kept)
    return max(abs(mean) - allowed, 0) / error / limit(len(values))


@pytest.mark.parametrize("allowed", [0.0, 0.05])
def test_ratio_is_that_of_the_channel_with_the_largest_t(allowed: float) -> None:
    difference = np.random.default_rng(3).normal([0.1, -0.3, 0.0], 1.0, (8, 8, 3))
    found = bias(difference, np.full_like(difference, allowed))
    expected = max(literal_ratio(difference[:, :, c].ravel().tolist(), allowed) for c in range(3))
    assert found.ratios.shape == (1, 1)
    assert found.ratios[0, 0] == pytest.approx(expected, rel=256 * EPS)


def test_blocks_cover_every_pixel_up_to_the_border() -> None:
    assert starts(24) == [0, 8, 16]
    assert starts(21) == [0, 8, 13]
    assert starts(5) == [0]
    picture = np.arange(21 * 10).reshape(21, 10)
    blocks = gathered(picture)
    assert blocks.shape == (3, 2, 64)
    assert blocks[2, 1].tolist() == picture[13:21, 2:10].ravel().tolist()
    assert set(blocks.ravel().tolist()) == set(range(210))


def test_block_without_noise_is_biased_beyond_what_is_allowed() -> None:
    difference = np.zeros((8, 16, 3))
    difference[:, 8:, 1] = 2.0**-5
    assert bias(difference, np.full_like(difference, 2.0**-6)).ratios.tolist() == [[0.0, np.inf]]
    assert bias(difference, np.full_like(difference, 2.0**-5)).share == 0.0


def test_fireflies_make_no_block_biased_and_hide_none() -> None:
    noise = 0.01 * np.random.default_rng(6).standard_normal((8, 8, 3))
    noise[0, :4] = 30.0
    nothing = np.zeros_like(noise)
    assert bias(noise, nothing).share == 0.0
    assert bias(noise + 0.02, nothing).share == 1.0
