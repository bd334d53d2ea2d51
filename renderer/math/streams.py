"""Random numbers as a pure function of (seed, pixel, sample, dimension).

Nothing is drawn in sequence, so no number depends on the tile, worker or attempt that uses it. The mixers are
SplitMix64 (Steele, Lea, Flood 2014) for keys and a 32-bit xorshift-multiply permutation (Wellons,
"Prospecting for hash functions", 2018) for the numbers.
"""

import numpy as np
from numpy.typing import NDArray

Keys = NDArray[np.uint64]
"""One 64-bit key a stream."""
Bits = NDArray[np.uint32]
"""32 random bits an element."""

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
"""2**64 over the golden ratio, made odd: the increment of SplitMix64."""


def _mixed(key: Keys) -> Keys:
    key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return key ^ (key >> np.uint64(31))


def keys(seed: int, *counters: NDArray[np.integer] | int) -> Keys:
    """Keys of the streams named by a seed and any number of counters, which broadcast.

    Parameters
    ----------
    seed : int
        0 <= seed < 2**64.
    *counters : int or array of int
        Pixel number, sample number, dimension and so on, each at least 0.
    """
    with np.errstate(over="ignore"):
        key = _mixed(np.atleast_1d(np.uint64(seed)) + _GOLDEN)
        for counter in counters:
            key = _mixed(key ^ (np.asarray(counter).astype(np.uint64) * _GOLDEN + np.uint64(1)))
    return key


def branch(paths: Keys, kind: int) -> Keys:
    """Names of paths continued by a bounce of some kind, (N,); two histories share one only by collision."""
    with np.errstate(over="ignore"):
        return _mixed(paths + _GOLDEN * np.uint64(kind + 1))


def bits(key: Keys, counter: NDArray[np.integer] | int) -> Bits:
    """32 random bits for each key and counter; the shapes broadcast."""
    low = (key & np.uint64(0xFFFFFFFF)).astype(np.uint32)
    high = (key >> np.uint64(32)).astype(np.uint32)
    with np.errstate(over="ignore"):
        x = low + np.asarray(counter).astype(np.uint32) * np.uint32(0x9E3779B9)
        x ^= x >> np.uint32(16)
        x *= np.uint32(0x7FEB352D)
        x ^= high
        x ^= x >> np.uint32(15)
        x *= np.uint32(0x846CA68B)
        x ^= x >> np.uint32(16)
    return x


def uniforms(random_bits: Bits) -> NDArray[np.float64]:
    """Numbers in [0, 1): multiples of 2**-24, which float32 holds exactly too."""
    return (random_bits >> np.uint32(8)).astype(np.float64) * 2.0**-24
