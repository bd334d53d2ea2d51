"""Random numbers: uniform, without memory, and a function of their counters alone.

Seeds are fixed. Each threshold would fail one right generator in a million.
"""

import itertools

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.math.streams import bits, keys, uniforms
from renderer.samplers import PATTERNS

ONE_IN_A_MILLION = 4.9  # standard deviations, both sides


def chi_square_p(counts: NDArray[np.int64]) -> float:
    """Probability of counts as uneven as these, if all cells are equally likely."""
    expected = counts.sum() / counts.size
    statistic = float(((counts - expected) ** 2 / expected).sum())
    return float(mpmath.gammainc((counts.size - 1) / 2, statistic / 2, regularized=True))


def drawn(seed: int, pixels: int, dimension: int = 0, samples: int = 1) -> NDArray[np.float64]:
    """(pixels, 2 samples) numbers of neighbouring pixels."""
    index = np.arange(2 * samples)
    return uniforms(bits(keys(seed, dimension, np.arange(pixels))[:, None], index[None, :]))


@pytest.mark.parametrize("seed", [0, 1, 2, 2**53 - 1])
def test_numbers_are_uniform(seed: int) -> None:
    counts, _ = np.histogram(drawn(seed, 1 << 14, samples=4), bins=256, range=(0, 1))
    assert 1e-6 < chi_square_p(counts) < 1 - 1e-6


@pytest.mark.parametrize("seed", [0, 7])
def test_neighbouring_pairs_fill_the_square(seed: int) -> None:
    """Of neighbouring pixels, samples, dimensions and seeds, in 32 x 32 cells."""
    first = drawn(seed, 1 << 15)
    pairs = {
        "samples": (first[:, 0], first[:, 1]),
        "pixels": (first[:-1, 0], first[1:, 0]),
        "dimensions": (first[:, 0], drawn(seed, 1 << 15, dimension=1)[:, 0]),
        "seeds": (first[:, 0], drawn(seed + 1, 1 << 15)[:, 0]),
    }
    for name, (a, b) in pairs.items():
        counts, _, _ = np.histogram2d(a, b, bins=32, range=[[0, 1], [0, 1]])
        assert 1e-6 < chi_square_p(counts.ravel()) < 1 - 1e-6, name


def test_streams_are_uncorrelated() -> None:
    """Rows of a picture too: 512 pixels apart."""
    numbers = drawn(3, 1 << 16)[:, 0] - 0.5
    for distance in (1, 2, 3, 16, 512):
        correlation = 12 * np.mean(numbers[:-distance] * numbers[distance:])
        assert abs(correlation) * np.sqrt(numbers.size) < ONE_IN_A_MILLION


def test_bits_flip_with_any_counter() -> None:
    n = 1 << 14
    before = bits(keys(5, 0, np.arange(n)), 0)
    others = [
        bits(keys(5, 0, np.arange(n)), 1),
        bits(keys(5, 1, np.arange(n)), 0),
        bits(keys(6, 0, np.arange(n)), 0),
    ]
    for words in (before, *(before ^ other for other in others)):
        for bit in range(32):
            share = np.mean((words >> np.uint32(bit)) & np.uint32(1))
            assert abs(share - 0.5) * 2 * np.sqrt(n) < ONE_IN_A_MILLION + 0.5


@pytest.mark.parametrize("pattern", ["random", "stratified", "sobol"])
def test_sample_is_free_of_its_batch(pattern: str) -> None:
    """Not on which others are requested with it, nor on their order."""
    pixels, samples = np.arange(40).repeat(9), np.tile(np.arange(9), 40)
    together = np.array(PATTERNS[pattern](keys(3, 0, pixels), samples, 9))
    shuffled = np.random.default_rng(1).permutation(360)
    again = np.array(PATTERNS[pattern](keys(3, 0, pixels[shuffled]), samples[shuffled], 9))
    assert (again == together[:, shuffled]).all()
    for i in range(0, 360, 37):
        alone = np.array(PATTERNS[pattern](keys(3, 0, pixels[i : i + 1]), samples[i : i + 1], 9))
        assert (alone[:, 0] == together[:, i]).all()


@pytest.mark.parametrize("pattern", ["random", "stratified", "sobol"])
def test_streams_differ(pattern: str) -> None:
    index = np.arange(16)
    sets = [
        np.array(PATTERNS[pattern](keys(seed, dimension, pixel), index, 16))
        for seed, dimension, pixel in itertools.product((0, 1, 2**52), (0, 1, 2), (0, 1, 511, 512))
    ]
    for a, b in itertools.combinations(sets, 2):
        assert (a != b).any()


def test_numbers_are_exact_float32_below_1() -> None:
    largest = uniforms(np.array([0, 0xFFFFFFFF], dtype=np.uint32))
    assert largest.tolist() == [0.0, 1 - 2.0**-24]
    assert (largest.astype(np.float32) == largest).all()
