"""The first two dimensions of Sobol's sequence with Owen's scrambling.

Scrambling by hashing (Laine, Karras 2011; Burley 2020, "Practical hash-based Owen scrambling").
Any first 2**m points put one point in each elementary interval, scrambled or not.
"""

import numpy as np

from renderer.arrays import Floats
from renderer.streams import Bits, Keys, bits, uniforms

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
    """Sobol's second coordinate: direction numbers v, v ^ v >> 1 (the primitive polynomial x + 1)."""
    result = np.zeros_like(index)
    direction = 0x80000000
    for bit in range(32):
        result ^= np.where((index >> _U(bit)) & _U(1) != 0, _U(direction), _U(0))
        direction ^= direction >> 1
    return result


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
