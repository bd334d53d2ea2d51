"""The first two dimensions of Sobol's sequence with Owen's scrambling.

Scrambling by hashing (Laine, Karras 2011; Burley 2020, "Practical hash-based Owen scrambling").
Any first 2**m points put one point in each elementary interval, scrambled or not.
"""

import numpy as np

from renderer.math.arrays import Floats
from renderer.math.streams import Bits, Keys, bits, uniforms

_U = np.uint32


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


def points(key: Keys, index: Bits) -> tuple[Floats, Floats]:
    """Points number `index` of the set that `key` scrambles; the shapes broadcast."""
    first = scrambled(reversed_bits(index), bits(key, 0))
    second = scrambled(second_dimension(index), bits(key, 1))
    return uniforms(first), uniforms(second)
