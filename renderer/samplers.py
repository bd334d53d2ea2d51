"""Sample patterns on the unit square, for pixels and lights: one function a pattern.

Each takes keys (one a stream, shape broadcasting with `index`), the sample numbers and the number of
samples in a set, and gives two coordinates in [0, 1). Fixed patterns do not use the keys.

Sobol points are the first two dimensions of the Sobol sequence with Owen's scrambling by hashing (Laine,
Karras 2011; Burley 2020, "Practical hash-based Owen scrambling"). Any first 2**m points put one point in
each elementary interval, scrambled or not.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats
from renderer.math.streams import Bits, Keys, bits, uniforms

_U = np.uint32

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


def reversed_bits(x: Bits) -> Bits:
    """The 32 bits in opposite order."""
    x = x.byteswap()
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F)):
        upper = x >> _U(shift)
        upper &= _U(mask)
        x &= _U(mask)
        x <<= _U(shift)
        x |= upper
    return x


def second_dimension(index: Bits) -> Bits:
    """Sobol's second coordinate, of the primitive polynomial x + 1.

    Its matrix is Pascal's triangle modulo 2, which is a product of five sparse ones: where bit b of a row's
    number is set, add the bits 2**b places up.
    """
    for shift, mask in (
        (1, 0x55555555),
        (2, 0x33333333),
        (4, 0x0F0F0F0F),
        (8, 0x00FF00FF),
        (16, 0x0000FFFF),
    ):
        index = index ^ ((index >> _U(shift)) & _U(mask))
    return reversed_bits(index)


def scrambled(x: Bits, seed: Bits) -> Bits:
    """Owen's nested uniform scrambling; `x` and `seed` broadcast."""
    with np.errstate(over="ignore"):
        x = reversed_bits(x) + seed
        x = x ^ (x * _U(0x6C50B47C))
        x = x ^ (x * _U(0xB82F1E52))
        x = x ^ (x * _U(0xC7AFE638))
        x = x ^ (x * _U(0x8D22F6E6))
    return reversed_bits(x)


def sobol(key: Keys, index: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:  # noqa: ARG001
    """Owen-scrambled Sobol points, a scrambling a key."""
    number = np.asarray(index).astype(_U)
    first = scrambled(reversed_bits(number), bits(key, 0))
    second = scrambled(second_dimension(number), bits(key, 1))
    return uniforms(first), uniforms(second)


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
