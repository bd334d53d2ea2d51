"""Random numbers and sample patterns. Each threshold fails one right generator in a million."""

import itertools
import math

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.math.streams import bits, keys, uniforms
from renderer.samplers import FIXED, PATTERNS

KEYS = [keys(seed, 0, pixel) for seed, pixel in itertools.product((0, 1, 99), (0, 1, 262143))]
RANDOM = ["random", "stratified", "sobol"]


def points(pattern: str, count: int, key: NDArray[np.uint64] = KEYS[0]) -> NDArray[np.float64]:
    return np.array(PATTERNS[pattern](key, np.arange(count), count))


@pytest.mark.parametrize("power", range(9))
@pytest.mark.parametrize("key", KEYS)
def test_sobol_points_are_a_net(key: NDArray[np.uint64], power: int) -> None:
    """Each box of area 2**-m, whatever its shape, holds one point of each aligned run of 2**m."""
    size = 1 << power
    for start in (0, size, 3 * size):
        x, y = PATTERNS["sobol"](key, np.arange(start, start + size), 4 * size)
        for columns in range(power + 1):
            cells = np.floor(x * 2**columns) + 2**columns * np.floor(y * 2 ** (power - columns))
            assert sorted(cells) == list(range(size))


@pytest.mark.parametrize(
    ("count", "columns", "rows"), [(1, 1, 1), (16, 4, 4), (6, 3, 2), (7, 7, 1), (12, 4, 3), (256, 16, 16)]
)
def test_stratified_points_lie_one_in_each_cell(count: int, columns: int, rows: int) -> None:
    for key in KEYS:
        x, y = points("stratified", count, key)
        assert sorted(np.floor(x * columns) + columns * np.floor(y * rows)) == list(range(count))


@pytest.mark.parametrize("n", range(1, 9))
def test_fixed_patterns_are_their_grids(n: int) -> None:
    """Centres of cells; the same turned by atan(1/2) about the middle and wrapped into the pixel."""
    x, y = points("uniform", n * n)
    centres = {((i + 0.5) / n, (j + 0.5) / n) for i in range(n) for j in range(n)}
    assert set(zip(x.tolist(), y.tolist(), strict=True)) == centres
    a, b = x - 0.5, y - 0.5
    x, y = points("rotated", n * n)
    assert ((x >= 0) & (x < 1) & (y >= 0) & (y < 1)).all()
    cos, sin = 2 / math.sqrt(5), 1 / math.sqrt(5)
    for found, exact in ((x, a * cos - b * sin + 0.5), (y, a * sin + b * cos + 0.5)):
        assert np.abs(found - exact % 1).max() <= 1e-15
        assert abs(found.mean() - 0.5) <= 1e-15


def test_fixed_patterns_are_equal_in_every_pixel() -> None:
    assert points("center", 1).tolist() == [[0.5], [0.5]]
    for pattern, key in itertools.product(FIXED - {"center"}, KEYS):
        assert (points(pattern, 16, key) == points(pattern, 16)).all()


@pytest.mark.parametrize("pattern", RANDOM)
def test_random_patterns_have_the_moments_of_the_square(pattern: str) -> None:
    """Over 4096 keys, within 5 standard deviations of an independent sample; all inside the square."""
    key = keys(11, 0, np.arange(4096))[:, None]
    x, y = PATTERNS[pattern](key, np.arange(4)[None, :], 4)
    for coordinate in (x, y):
        assert ((coordinate >= 0) & (coordinate < 1)).all()
        for power in (1, 2, 3):
            sigma = math.sqrt(1 / (2 * power + 1) - 1 / (power + 1) ** 2) / math.sqrt(coordinate.size)
            assert abs(np.mean(coordinate**power) - 1 / (power + 1)) <= 5 * sigma
    assert abs(np.mean((x - 0.5) * (y - 0.5)) * 12) <= 5 / math.sqrt(x.size)


@pytest.mark.parametrize("pattern", RANDOM)
def test_sample_depends_on_its_counters_alone(pattern: str) -> None:
    """Not on which others are requested with it, nor on their order; and on all of its counters."""
    pixels, samples = np.arange(40).repeat(9), np.tile(np.arange(9), 40)
    together = np.array(PATTERNS[pattern](keys(3, 0, pixels), samples, 9))
    shuffled = np.random.default_rng(1).permutation(360)
    again = np.array(PATTERNS[pattern](keys(3, 0, pixels[shuffled]), samples[shuffled], 9))
    assert (again == together[:, shuffled]).all()
    for i in range(0, 360, 37):
        alone = np.array(PATTERNS[pattern](keys(3, 0, pixels[i : i + 1]), samples[i : i + 1], 9))
        assert (alone[:, 0] == together[:, i]).all()
    counters = itertools.product((0, 1, 2**52), (0, 1, 2), (0, 1, 511, 512))
    sets = [points(pattern, 16, keys(*each)) for each in counters]
    assert all((a != b).any() for a, b in itertools.combinations(sets, 2))


def chi_square_p(counts: NDArray[np.int64]) -> float:
    """Probability of counts as uneven as these, if all cells are equally likely."""
    expected = counts.sum() / counts.size
    statistic = float(((counts - expected) ** 2 / expected).sum())
    return float(mpmath.gammainc((counts.size - 1) / 2, statistic / 2, regularized=True))


def drawn(seed: int, pixels: int, dimension: int = 0, samples: int = 1) -> NDArray[np.float64]:
    """(pixels, 2 samples) numbers of neighbouring pixels."""
    index = np.arange(2 * samples)
    return uniforms(bits(keys(seed, dimension, np.arange(pixels))[:, None], index[None, :]))


@pytest.mark.parametrize("seed", [0, 1, 2**53 - 1])
def test_numbers_are_uniform(seed: int) -> None:
    counts, _ = np.histogram(drawn(seed, 1 << 14, samples=4), bins=256, range=(0, 1))
    assert 1e-6 < chi_square_p(counts) < 1 - 1e-6
    largest = uniforms(np.array([0, 0xFFFFFFFF], dtype=np.uint32))
    assert largest.tolist() == [0.0, 1 - 2.0**-24]
    assert (largest.astype(np.float32) == largest).all()


@pytest.mark.parametrize("seed", [0, 7])
def test_pairs_of_neighbours_fill_the_square(seed: int) -> None:
    """Of neighbouring pixels, samples, dimensions, seeds and rows of 512 pixels, in 32 x 32 cells."""
    first = drawn(seed, 1 << 15)
    pairs = {
        "samples": (first[:, 0], first[:, 1]),
        "pixels": (first[:-1, 0], first[1:, 0]),
        "rows": (first[:-512, 0], first[512:, 0]),
        "dimensions": (first[:, 0], drawn(seed, 1 << 15, dimension=1)[:, 0]),
        "seeds": (first[:, 0], drawn(seed + 1, 1 << 15)[:, 0]),
    }
    for name, (a, b) in pairs.items():
        counts, _, _ = np.histogram2d(a, b, bins=32, range=[[0, 1], [0, 1]])
        assert 1e-6 < chi_square_p(counts.ravel()) < 1 - 1e-6, name
