"""Errors of hits in shares of what rounding may do to them: 1 and less is right.

Hit or miss is excused within 16 roundings of the border. With s the largest number of ray and shape and c the
cosine between ray and normal, a place is uncertain by some eps s across the surface, and by that over c along
the ray.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tests.numerics import oracle
from tests.numerics.families import FamilyCase
from tests.numerics.oracle import Answer
from tests.numerics.tracing import EPS, read_shape, traced

Floats = np.ndarray
EXCUSED = 16 * EPS
"""Distance from the border, in shares of the largest coordinate, where hit and miss are both right."""

Allowed = Callable[[Any, Answer, Floats, Floats], float]
"""A shape, the exact answer and the ray, to the error of t that is right, in units of t."""


def relative(_shape: Any, true: Answer, _origin: Floats, _direction: Floats) -> float:
    return 1e-10 * true.t


def assert_right(family: Iterable[FamilyCase], details: Any = None, allowed: Allowed = relative) -> None:
    """Ask `renderer.trace` about a family of rays, and compare with exact answers."""
    hit = 0
    for document, rays in family:
        shape = read_shape(document)
        origins, directions = (np.array(part, dtype=np.float64) for part in zip(*rays, strict=True))
        found = traced([document], origins, directions)
        for i, ray in enumerate(rays):
            true = oracle.answer(shape, *ray)
            hit += true.hit
            if true.hit != math.isfinite(found.t[i]):
                assert true.margin <= EXCUSED, ray
            elif true.hit:
                assert abs(found.t[i] - true.t) <= allowed(shape, true, origins[i], directions[i]), ray
                if details is not None:
                    seen = (found.position[i], found.normal[i], found.uv[i])
                    assert details(shape, true, (origins[i], directions[i]), seen) <= 1, ray
            else:
                assert found.t[i] == math.inf
    assert hit >= 50


def edges(shape: Any) -> Floats:
    """Edges of a triangle or parallelogram, (edges, 3)."""
    if shape.type == "triangle":
        return np.array([np.subtract(p, q) for p, q in itertools.combinations(shape.vertices, 2)])
    return np.array(shape.edges)


def least_height(shape: Any) -> float:
    """Area of the parallelogram of two edges over the longest edge."""
    first, second, *_ = edges(shape)
    return float(np.linalg.norm(np.cross(first, second)) / np.linalg.norm(edges(shape), axis=1).max())


def semi_axes(shape: Any) -> Floats:
    """Semi-axes of an ellipsoid, one a row."""
    return np.array(shape.axes) if hasattr(shape, "axes") else np.eye(3) * shape.radius


def _rounding(shape: Any, origin: Floats) -> float:
    """Eight roundings of the largest number of a ray's origin and of a shape."""
    if shape.type == "triangle":
        places = np.array(shape.vertices)
    elif shape.type == "rectangle":
        places = np.array((shape.corner, *shape.edges))
    else:
        places = np.vstack((shape.center, semi_axes(shape)))
    return 8 * EPS * float(max(np.abs(origin).max(), np.abs(places).max()))


def _cosine(true: Answer, direction: Floats) -> float:
    return abs(float(np.dot(true.normal, direction))) / math.hypot(*direction)


def _along(across: float, true: Answer, direction: Floats) -> float:
    """Error of t of a place that is off across the surface by a length."""
    return across / _cosine(true, direction) / math.hypot(*direction)


def rounded(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
    """8 eps s / c; times longest edge over least height for a triangle, whose t is a mean."""
    across = _rounding(shape, origin)
    if shape.type == "triangle":
        across *= np.linalg.norm(edges(shape), axis=1).max() / least_height(shape)
    return _along(across, true, direction)


def of_the_axes(roundings: float) -> Allowed:
    """So many roundings of the longest semi-axis, over c."""
    return lambda shape, true, _, direction: _along(
        roundings * EPS * float(np.linalg.norm(semi_axes(shape), axis=1).max()), true, direction
    )


def flat_details(shape: Any, true: Answer, ray: Any, found: Any) -> float:
    """Off the plane by 8 eps s, normal by 8 eps over the sine, uv by 32 eps s over least height and c."""
    (origin, direction), (position, normal, uv) = ray, found
    rounding = _rounding(shape, origin)
    first, second = sorted(edges(shape), key=np.linalg.norm)[:2]
    sine = float(np.linalg.norm(np.cross(first, second)) / np.linalg.norm(first) / np.linalg.norm(second))
    moved = float(np.abs(uv - true.uv).max()) * least_height(shape) * _cosine(true, direction)
    return max(
        abs(float(np.dot(position - true.position, true.normal))) / rounding,
        float(np.abs(normal - true.normal).max()) * sine / (8 * EPS),
        moved / (4 * rounding),
    )


def round_details(shape: Any, true: Answer, ray: Any, found: Any) -> float:
    """Place as for flat shapes; normal and uv by 16 eps and what the place's uncertainty turns them by."""
    (origin, direction), (position, normal, uv) = ray, found
    place = _rounding(shape, origin)
    step = place / _cosine(true, direction)
    turn, slide = _steepness(shape, true.normal)
    off = position - np.array(true.position)
    across, along = np.abs(uv - true.uv)
    mapped = (16 * EPS + step * slide) / math.sin(math.pi * true.uv[1])
    errors = (
        abs(float(np.dot(off, true.normal))) / place,
        float(np.linalg.norm(off)) / step,
        angle(normal, true.normal) / (16 * EPS + step * turn),
        2 * math.pi * min(across, 1 - across) / mapped,
        math.pi * along / mapped,
    )
    return float(max(errors))


def _steepness(shape: Any, normal: Any) -> tuple[float, float]:
    """Turn of the normal by a step along the surface, and the length of that step on the unit sphere.

    With A the matrix of semi-axes and N = A^-T u the normal at the place u of the unit sphere, that is at
    most |A^-1 P|^2 / |N| and |A^-1 P| of its length, P the projection on the tangent plane.
    """
    axes = semi_axes(shape)
    rows = axes / (axes * axes).sum(axis=1)[:, None]
    flat = float(np.linalg.norm(rows - np.outer(rows @ normal, normal)))
    return flat * flat * float(np.linalg.norm(axes @ normal)), flat


def angle(a: Floats, b: Any) -> float:
    """Between unit vectors, radians; small ones keep their digits."""
    return 2 * math.asin(min(1.0, float(np.linalg.norm(np.subtract(a, b))) / 2))
