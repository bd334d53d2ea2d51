"""Sample patterns in the unit square."""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.math.streams import keys
from renderer.samplers import FIXED, PATTERNS

KEYS = [keys(seed, 0, pixel) for seed, pixel in itertools.product((0, 1, 99), (0, 1, 262143))]


def points(pattern: str, count: int, key: NDArray[np.uint64] = KEYS[0]) -> NDArray[np.float64]:
    return np.array(PATTERNS[pattern](key, np.arange(count), count))


@pytest.mark.parametrize("power", range(9))
@pytest.mark.parametrize("key", KEYS)
def test_sobol_points_are_a_net(key: NDArray[np.uint64], power: int) -> None:
    """Each of the 2**m boxes of area 2**-m, whatever its shape, holds one of the first 2**m points."""
    x, y = points("sobol", 1 << power, key)
    for columns in range(power + 1):
        cells = np.floor(x * 2**columns) + 2**columns * np.floor(y * 2 ** (power - columns))
        assert sorted(cells) == list(range(1 << power))


@pytest.mark.parametrize("power", range(1, 9))
def test_aligned_runs_are_nets(power: int) -> None:
    """So each pass of samples is well spread, not only all of them."""
    size = 1 << power
    for start in (size, 3 * size):
        x, y = PATTERNS["sobol"](KEYS[1], np.arange(start, start + size), 4 * size)
        for columns in range(power + 1):
            cells = np.floor(x * 2**columns) + 2**columns * np.floor(y * 2 ** (power - columns))
            assert sorted(cells) == list(range(size))


@pytest.mark.parametrize(
    ("count", "columns", "rows"), [(1, 1, 1), (16, 4, 4), (6, 3, 2), (7, 7, 1), (12, 4, 3), (256, 16, 16)]
)
@pytest.mark.parametrize("key", KEYS[:3])
def test_stratified_points_fill_cells(key: NDArray[np.uint64], count: int, columns: int, rows: int) -> None:
    x, y = points("stratified", count, key)
    cells = np.floor(x * columns) + columns * np.floor(y * rows)
    assert sorted(cells) == list(range(count))


@pytest.mark.parametrize("n", range(1, 9))
def test_uniform_points_are_centres(n: int) -> None:
    x, y = points("uniform", n * n)
    centres = {((i + 0.5) / n, (j + 0.5) / n) for i in range(n) for j in range(n)}
    assert set(zip(x.tolist(), y.tolist(), strict=True)) == centres


@pytest.mark.parametrize("n", range(2, 9))
def test_rotated_points_are_a_turned_grid(n: int) -> None:
    """All inside, their mean in the middle, in three times as many columns and rows as the grid has."""
    x, y = points("rotated", n * n)
    assert ((x >= 0) & (x < 1) & (y >= 0) & (y < 1)).all()
    angle = math.atan(0.5)
    a, b = points("uniform", n * n) - 0.5
    assert np.abs(x - (a * math.cos(angle) - b * math.sin(angle) + 0.5) % 1).max() <= 1e-15
    assert np.abs(y - (a * math.sin(angle) + b * math.cos(angle) + 0.5) % 1).max() <= 1e-15
    assert abs(x.mean() - 0.5) <= 1e-15
    assert abs(y.mean() - 0.5) <= 1e-15
    assert len(np.unique(x.round(12))) == len(np.unique(y.round(12))) == 3 * n - 2


@pytest.mark.parametrize("pattern", sorted(FIXED))
def test_fixed_patterns_repeat(pattern: str) -> None:
    count = 1 if pattern == "center" else 16
    for key in KEYS:
        assert (points(pattern, count, key) == points(pattern, count)).all()


@pytest.mark.parametrize("pattern", sorted(set(PATTERNS) - FIXED))
def test_random_patterns_are_unbiased(pattern: str) -> None:
    """Over 4096 keys, within 5 standard deviations of an independent sample; all inside the square."""
    key = keys(11, 0, np.arange(4096))[:, None]
    x, y = PATTERNS[pattern](key, np.arange(4)[None, :], 4)
    for coordinate in (x, y):
        assert ((coordinate >= 0) & (coordinate < 1)).all()
        for power in (1, 2, 3):
            sigma = math.sqrt(1 / (2 * power + 1) - 1 / (power + 1) ** 2) / math.sqrt(coordinate.size)
            assert abs(np.mean(coordinate**power) - 1 / (power + 1)) <= 5 * sigma
    product = np.mean((x - 0.5) * (y - 0.5)) * 12
    assert abs(product) <= 5 / math.sqrt(x.size)


@pytest.mark.parametrize("offset", np.linspace(0.013, 0.987, 25))
@pytest.mark.parametrize("slope", [0.0, 0.37, 1.0])
def test_edge_through_a_pixel(offset: float, slope: float) -> None:
    """Half planes x < offset + slope (y - 1/2) against their area; 64 samples come within 1/8."""
    rows = (np.arange(20000) + 0.5) / 20000
    area = float(np.clip(offset + slope * (rows - 0.5), 0, 1).mean())
    for pattern, bound in (
        ("uniform", 1 / 8),
        ("rotated", 1 / 8),
        ("stratified", 1 / 8),
        ("sobol", 1 / 8),
        ("random", 4 * 0.5 / 8),
    ):
        x, y = points(pattern, 64, KEYS[2])
        assert abs(np.mean(x < offset + slope * (y - 0.5)) - area) <= bound
