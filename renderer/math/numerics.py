"""Rounding-error bounds and sums whose order is fixed.

All bounds are relative: each is a multiple of the numbers that it applies to.
"""

import numpy as np

from renderer.math.arrays import Floats, Masks, Pairs

EPS = float(np.finfo(np.float64).eps)
"""Spacing of float64 at 1."""


def gamma(n: int) -> float:
    """Bound on the relative error of n chained float64 operations (Higham 2002, lemma 3.1)."""
    return n * EPS / 2 / (1 - n * EPS / 2)


PLANE_ERROR = gamma(24)
"""A computed point lies within PLANE_ERROR * (sizes of its shape and of the other) of its shape's plane.

Twelve roundings form the point from corner, edges and coordinates; its distance from another
shape's plane takes as many again.
"""


def unit_of(sizes: Floats) -> Floats:
    """Powers of two that bring positive sizes to between 1/2 and 1.

    Lengths in such a unit lose no digit to it, and float32 holds them whatever the scene's unit is.
    """
    return np.ldexp(1.0, -np.frexp(sizes)[1])


def halving_sum(terms: Pairs) -> Pairs:
    """Sum over axis 0 by halves, (L, N) -> (N,); overwrites `terms`.

    The order of additions depends on L alone. `np.add.reduce` would change it when N is 1.
    Relative error at most log2(L) / 2 spacings of the dtype for terms of one sign.
    """
    count = terms.shape[0]
    while count > 1:
        half = count // 2
        rest = count - half
        np.add(terms[:half], terms[rest:count], out=terms[:half])
        count = rest
    return terms[0]


def outward(values: Floats, dtype: np.dtype[np.floating]) -> Pairs:
    """Values rounded to `dtype` and moved up by four spacings.

    An occluder's edge functions are rounded once each. Moved towards 'inside', two occluders that
    share an edge overlap there by some spacings and let no light through.
    """
    with np.errstate(over="ignore"):
        return (values + 4 * float(np.finfo(dtype).eps) * np.abs(values)).astype(dtype)


def finite(values: Floats) -> Masks:
    """Columns whose three components are all finite, (3, N) -> (N,)."""
    return np.isfinite(values[0]) & np.isfinite(values[1]) & np.isfinite(values[2])
