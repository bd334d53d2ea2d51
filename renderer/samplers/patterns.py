"""Sample patterns in the unit square, one function a pattern.

Each takes keys (one a stream, shape broadcasting with `index`), the sample numbers and the number of
samples in a set, and gives two coordinates in [0, 1). Fixed patterns do not look at the keys.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats
from renderer.math.streams import Keys, bits, uniforms
from renderer.samplers import sobol as owen

Pattern = Callable[[Keys, NDArray[np.int64], int], tuple[Floats, Floats]]
"""(keys, sample numbers, samples in a set) -> two coordinates in [0, 1)."""


def strata(count: int) -> tuple[int, int]:
    """Columns and rows of the most nearly square grid with `count` cells."""
    rows = max(n for n in range(1, int(np.sqrt(count) + 0.5) + 1) if count % n == 0)
    return count // rows, rows


def center(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:  # noqa: ARG001
    """The middle of the square."""
    middle = np.full(np.shape(index), 0.5)
    return middle, middle


def uniform(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:  # noqa: ARG001
    """Centres of the cells of an n x n grid, row by row; count = n * n."""
    columns, rows = strata(count)
    return (index % columns + 0.5) / columns, (index // columns + 0.5) / rows


def rotated(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:
    """The uniform grid turned by atan(1/2) = 26.565 degrees about the middle, wrapped into the square.

    cos and sin of the angle are 2 and 1 over sqrt(5).
    """
    a, b = uniform(key, index, count)
    a, b = a - 0.5, b - 0.5
    turned_a, turned_b = (2 * a - b) / np.sqrt(5.0) + 0.5, (a + 2 * b) / np.sqrt(5.0) + 0.5
    return turned_a - np.floor(turned_a), turned_b - np.floor(turned_b)


def random(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:  # noqa: ARG001
    """Independent uniform numbers."""
    return uniforms(bits(key, 2 * index)), uniforms(bits(key, 2 * index + 1))


def stratified(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:
    """One random point in each cell of the most nearly square grid of `count` cells."""
    a, b = random(key, index, count)
    columns, rows = strata(count)
    return (index % columns + a) / columns, (index // columns + b) / rows


def sobol(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:  # noqa: ARG001
    """Owen-scrambled Sobol points, a scrambling a key."""
    return owen.points(key, np.asarray(index).astype(np.uint32))


PATTERNS: dict[str, Pattern] = {
    "center": center,
    "uniform": uniform,
    "rotated": rotated,
    "random": random,
    "stratified": stratified,
    "sobol": sobol,
}
"""Every pattern by its name in the scene language."""

FIXED = frozenset({"center", "uniform", "rotated"})
"""Patterns that are the same for every key."""
