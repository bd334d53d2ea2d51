"""Reflection and refraction: directions, and the share of light in each."""

import numpy as np

from renderer.math.arrays import Floats, dot


def reflected(viewers: Floats, shading_normals: Floats, normals: Floats) -> Floats:
    """Viewers' directions mirrored at shading normals, never below the true surface, (3, N).

    Of length 1 up to rounding. A direction that a bent normal would send below the surface is mirrored at the
    surface once more, like light in a groove.
    """
    directions = 2 * dot(shading_normals, viewers) * shading_normals - viewers
    return _beyond(directions, normals)


def refracted(viewers: Floats, shading_normals: Floats, normals: Floats, ratio: Floats) -> Floats:
    """Directions by Snell's law, never above the true surface, (3, N), of length 1 as `reflected`.

    Parameters
    ----------
    viewers, shading_normals, normals : (3, N) float64
        Unit vectors, normals on the viewers' side.
    ratio : (N,) float64
        Refractive index on the viewers' side over that beyond.

    Notes
    -----
    Under total reflection the result runs along the surface; no light goes there.
    """
    cosine = _cosine(viewers, shading_normals)
    inner = transmitted_cosine(cosine, ratio)
    directions = (ratio * cosine - inner) * shading_normals - ratio * viewers
    return _beyond(directions, -normals)


def fresnel(viewers: Floats, shading_normals: Floats, ratio: Floats) -> Floats:
    """Share of unpolarised light that a dielectric reflects, (N,): 1 under total reflection.

    The mean of the squares of Fresnel's two amplitudes. The square root of a negative number is taken as 0,
    which makes both amplitudes 1. Where both cosines are 0, only an index of 1 reflects nothing.
    """
    cosine = _cosine(viewers, shading_normals)
    inner = transmitted_cosine(cosine, ratio)
    grazing = (cosine == 0) & (inner == 0)
    below = np.where(grazing, 1.0, inner)
    across = (ratio * cosine - below) / (ratio * cosine + below)
    along = (cosine - ratio * below) / (cosine + ratio * below)
    return np.where(grazing, np.where(ratio == 1, 0.0, 1.0), (across * across + along * along) / 2)


def transmitted_cosine(cosine: Floats, ratio: Floats) -> Floats:
    """Cosine of the refracted angle, (N,), 0 under total reflection.

    The square is 1 - ratio^2 (1 - cosine^2), written so that it is the cosine's own square where the ratio
    is 1: glass of index 1 bends nothing and reflects nothing.
    """
    square = (1 - ratio) * (1 + ratio) + (ratio * cosine) ** 2
    return np.sqrt(np.maximum(square, 0.0))


def _cosine(viewers: Floats, normals: Floats) -> Floats:
    return np.clip(dot(viewers, normals), 0.0, 1.0)


def _beyond(directions: Floats, normals: Floats) -> Floats:
    """Directions (3, N), those below the plane of `normals` mirrored at it."""
    return directions - 2 * np.minimum(dot(directions, normals), 0.0) * normals
