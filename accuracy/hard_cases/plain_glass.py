"""Snell, Fresnel and facing mirrors as textbooks write them, and Fresnel's formulas in 50 digits."""

import mpmath
import numpy as np

from renderer.math.arrays import Integers, Pairs


def plain_inner_cosine(cosine: Pairs, ratio: Pairs) -> Pairs:
    """Snell's law as textbooks write it: the cosine of the refracted angle, without any clamp."""
    one = cosine.dtype.type(1)
    return np.sqrt(one - ratio * ratio * (one - cosine * cosine))


def plain_fresnel(cosine: Pairs, ratio: Pairs) -> Pairs:
    """Fresnel's formulas on that cosine."""
    inner = plain_inner_cosine(cosine, ratio)
    across = (ratio * cosine - inner) / (ratio * cosine + inner)
    along = (cosine - ratio * inner) / (cosine + ratio * inner)
    return (across * across + along * along) / 2


def true_fresnel(cosine: float, ratio: float) -> float:
    """The reflected share in 50 digits, rounded once."""
    c, n = mpmath.mpf(cosine), mpmath.mpf(ratio)
    square = 1 - n * n * (1 - c * c)
    if square <= 0:
        return 1.0
    inner = mpmath.sqrt(square)
    across, along = (n * c - inner) / (n * c + inner), (c - n * inner) / (c + n * inner)
    return float((across**2 + along**2) / 2)


def endless(own: float, strength: float) -> float:
    """Radiance between two facing mirrors by plain recursion: this wall's own, and what it mirrors."""
    return own + strength * endless(own, strength)


def plain_meetings(center: Pairs, radius: np.floating, origins: Pairs, directions: Pairs) -> Integers:
    """How often refracted rays (3, N) meet a sphere, if each starts where `t > 1e-4`, (N,)."""
    dtype = directions.dtype.type
    counts = np.zeros(directions.shape[1], dtype=np.int64)
    alive = np.ones(counts.size, dtype=bool)
    for _ in range(4):
        b = (directions * (origins - center)).sum(axis=0)
        c = ((origins - center) ** 2).sum(axis=0) - radius * radius
        root = np.sqrt(b * b - c)
        ahead = [np.where(t > dtype(1e-4), t, dtype(np.inf)) for t in (-b - root, -b + root)]
        t = np.minimum(*ahead)
        alive &= np.isfinite(t)
        counts += alive
        origins = np.where(alive, origins + t * directions, origins)
        normals = (origins - center) / radius
        directions = np.where(alive, _plainly_bent(directions, normals), directions)
    return counts


def _plainly_bent(directions: Pairs, normals: Pairs) -> Pairs:
    along = (directions * normals).sum(axis=0)
    outwards = along > 0
    facing = np.where(outwards, -normals, normals)
    ratio = np.where(outwards, along.dtype.type(1.5), along.dtype.type(1 / 1.5))
    cosine = np.abs(along)
    bent = ratio * directions + (ratio * cosine - plain_inner_cosine(cosine, ratio)) * facing
    return bent / np.sqrt((bent * bent).sum(axis=0))
