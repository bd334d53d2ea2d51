"""How far rounding may move the answer about a ray and a flat shape.

With s the largest number of ray and shape, l the longest edge, f the least height, and c the cosine between
ray and normal: places are uncertain by some eps s, across the ray by that over c, and the weights of a
triangle's vertices by that over f.
"""

import itertools
import math
from typing import Any

import numpy as np

from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.scoring import Found, Tolerance
from renderer.math.arrays import Floats

ROUNDINGS = 8
"""Roundings of the largest number that a place may be off by."""
MORE_ROUNDINGS = 32
"""Those of texture coordinates, which some sums and quotients more go into."""


def edges(shape: Any) -> Floats:
    """Edges of a triangle or parallelogram, (edges, 3)."""
    if shape.type == "triangle":
        return np.array([np.subtract(p, q) for p, q in itertools.combinations(shape.vertices, 2)])
    return np.array(shape.edges)


def longest(shape: Any) -> float:
    """Length of the longest edge."""
    return float(np.linalg.norm(edges(shape), axis=1).max())


def least_height(shape: Any) -> float:
    """Area of the parallelogram of two edges over the longest edge."""
    first, second, *_ = edges(shape)
    return float(np.linalg.norm(np.cross(first, second))) / longest(shape)


def _scale(shape: Any, origin: Floats) -> float:
    places = shape.vertices if shape.type == "triangle" else (shape.corner, *shape.edges)
    return float(max(np.abs(origin).max(), np.abs(np.array(places)).max()))


def _cosine(true: Answer, direction: Floats) -> float:
    return abs(float(np.dot(true.normal, direction))) / math.hypot(*direction)


def rounded(dtype: type[np.floating]) -> Tolerance:
    """Error of t: 8 eps s / c, and for a triangle, whose t is a mean of its vertices', l / f times that."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        uncertain = ROUNDINGS * float(np.finfo(dtype).eps) * _scale(shape, origin)
        if shape.type == "triangle":
            uncertain *= longest(shape) / least_height(shape)
        return uncertain / _cosine(true, direction) / math.hypot(*direction)

    return Tolerance(dtype, allowed)


def details(shape: Any, true: Answer, found: Found) -> float:
    """Error of place, normal and texture coordinates, in shares of what is right.

    The place may be off the plane by 8 eps s, the normal by 8 eps over the sine between the two shortest
    edges, texture coordinates by 32 eps s / (f c).
    """
    eps = float(np.finfo(np.float64).eps)
    rounding = eps * _scale(shape, found.origin)
    off_plane = abs(float(np.dot(found.position - true.position, true.normal)))
    turned = float(np.abs(found.normal - true.normal).max())
    moved = float(np.abs(found.uv - true.uv).max())
    return max(
        off_plane / (ROUNDINGS * rounding),
        turned * _widest_sine(shape) / (ROUNDINGS * eps),
        moved * least_height(shape) * _cosine(true, found.direction) / (MORE_ROUNDINGS * rounding),
    )


def _widest_sine(shape: Any) -> float:
    first, second = sorted(edges(shape), key=np.linalg.norm)[:2]
    return float(np.linalg.norm(np.cross(first, second)) / np.linalg.norm(first) / np.linalg.norm(second))
