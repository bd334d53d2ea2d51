"""Judges answers about rays and one shape: hit or miss, t, place, normal and texture coordinates.

A hit for a miss, or the other way round, is excused within 16 roundings of the border, as the numbers that
came in were rounded too. Any other is wrong, and so is a hit that is off by more than rounding may move it.
With s the largest number of ray and shape and c the cosine between ray and normal, a place is uncertain by
some eps s across the surface, and by that over c along the ray.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases import oracle
from accuracy.hard_cases.documents import scene
from accuracy.hard_cases.families import FamilyCase
from accuracy.hard_cases.harness import EPS, Outcome, Outcomes, compiled, eps_of, judged
from accuracy.hard_cases.oracle import Answer
from renderer.math.arrays import Floats
from schemas.reading import read_scene

EXCUSED = 16
"""Roundings of the border within which either of hit and miss is right."""
ROUNDINGS = 8
"""Roundings of the largest number that a place may be off by."""
ROUNDINGS_OF_UV = 32
"""Those of texture coordinates of flat shapes, which some sums and quotients more go into."""
ROUNDINGS_OF_NORMALS = 16
"""Those of normals and texture coordinates of an ellipsoid at a place that is known."""

Textbook = Callable[[Any, Any, Any], Any]
"""A shape, origins (N, 3) and directions (N, 3) of one dtype, to t (N,): inf or NaN where nothing is hit."""

Allowed = Callable[[Any, Answer, Floats, Floats], float]
"""A shape, the exact answer, and the ray, to the error of t that is right, in units of t."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as right for one precision.

    Attributes
    ----------
    dtype : float32 or float64
    allowed : callable
    """

    dtype: type[np.floating]
    allowed: Allowed

    @property
    def margin(self) -> float:
        """Distance from the border, in shares of the largest coordinate, within which errors are excused."""
        return EXCUSED * eps_of(self.dtype)


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What the renderer says of one ray (3,) that hits."""

    origin: Floats
    direction: Floats
    position: Floats
    normal: Floats
    uv: Floats


Details = Callable[[Any, Answer, Found], float]
"""A shape, the exact answer and the renderer's, to the error of the rest, in shares of what is right."""

DOUBLE_TOLERANCE = Tolerance(np.float64, lambda _shape, true, _origin, _direction: 1e-10 * true.t)
SINGLE_TOLERANCE = Tolerance(np.float32, lambda _shape, true, _origin, _direction: 1e-4 * true.t)


def tried(
    family: Iterable[FamilyCase],
    textbook: Textbook,
    *,
    double: Tolerance = DOUBLE_TOLERANCE,
    single: Tolerance = SINGLE_TOLERANCE,
    details: Details | None = None,
) -> Outcomes:
    """Ask `renderer.trace`, and the textbook's formula in both precisions, about a family of rays.

    `details` judges what the renderer says beside t.
    """
    return (_tried(case, textbook, (double, single), details) for case in family)


def _tried(
    case: FamilyCase, textbook: Textbook, tolerances: tuple[Tolerance, Tolerance], details: Details | None
) -> Outcome:
    document, rays = case
    written = scene(document)
    shape = read_scene(written)[0].shapes[0]
    origins, directions = (np.array(part, dtype=np.float64) for part in zip(*rays, strict=True))
    true = [oracle.answer(shape, *ray) for ray in rays]

    def errors(tolerance: Tolerance, found: Floats) -> Floats:
        rows = zip(true, origins, directions, found, strict=True)
        return np.array([_error(tolerance, shape, *row) for row in rows])

    def plain_errors(tolerance: Tolerance) -> Floats:
        with np.errstate(all="ignore"):
            t = textbook(shape, origins.astype(tolerance.dtype), directions.astype(tolerance.dtype))
        return errors(tolerance, np.asarray(t, dtype=np.float64))

    hits = renderer.trace(compiled(written), origins, directions)
    off = errors(tolerances[0], hits.t)
    if details is not None:
        off = np.maximum(off, _errors_of_details(details, shape, true, hits, origins, directions))
    return judged(off, *map(plain_errors, tolerances))


def _error(
    tolerance: Tolerance, shape: Any, true: Answer, origin: Floats, direction: Floats, t: float
) -> float:
    """Error of t in shares of what is right: inf for a hit that is none, for a lost one, and for NaN."""
    if math.isnan(t) and tolerance.dtype is np.float64:
        return math.inf
    if true.hit != math.isfinite(t):
        return 0.0 if true.margin <= tolerance.margin else math.inf
    return abs(t - true.t) / tolerance.allowed(shape, true, origin, direction) if true.hit else 0.0


def _errors_of_details(
    details: Details, shape: Any, true: list[Answer], hits: renderer.Hits, origins: Floats, directions: Floats
) -> Floats:
    """Errors (N,) of what comes with right hits, in shares of what is right."""
    errors = np.zeros(len(true))
    for i, answer in enumerate(true):
        if answer.hit and math.isfinite(hits.t[i]):
            row = (origins[i], directions[i], hits.position[i], hits.normal[i], hits.uv[i])
            errors[i] = details(shape, answer, Found(*row))
    return errors


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


def semi_axes(shape: Any) -> Floats:
    """Semi-axes of an ellipsoid, one a row."""
    return np.array(shape.axes) if hasattr(shape, "axes") else np.eye(3) * shape.radius


def _largest(shape: Any, origin: Floats) -> float:
    """Largest number of a ray's origin and of a shape."""
    if shape.type == "triangle":
        places = np.array(shape.vertices)
    elif shape.type == "rectangle":
        places = np.array((shape.corner, *shape.edges))
    else:
        places = np.vstack((shape.center, semi_axes(shape)))
    return float(max(np.abs(origin).max(), np.abs(places).max()))


def _cosine(true: Answer, direction: Floats) -> float:
    return abs(float(np.dot(true.normal, direction))) / math.hypot(*direction)


def _along(across: float, true: Answer, direction: Floats) -> float:
    """Error of t of a place that is off across the surface by a length."""
    return across / _cosine(true, direction) / math.hypot(*direction)


def rounded(dtype: type[np.floating]) -> Tolerance:
    """Error of t: 8 eps s / c; times longest edge over least height for a triangle, whose t is a mean."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        across = ROUNDINGS * eps_of(dtype) * _largest(shape, origin)
        if shape.type == "triangle":
            across *= longest(shape) / least_height(shape)
        return _along(across, true, direction)

    return Tolerance(dtype, allowed)


def of_the_axes(roundings: float, dtype: type[np.floating]) -> Tolerance:
    """Error of t: so many roundings of the longest semi-axis, over c."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del origin
        longest_axis = float(np.linalg.norm(semi_axes(shape), axis=1).max())
        return _along(roundings * eps_of(dtype) * longest_axis, true, direction)

    return Tolerance(dtype, allowed)


def flat_details(shape: Any, true: Answer, found: Found) -> float:
    """Error of place, normal and texture coordinates of a flat shape, in shares of what is right.

    The place may be off the plane by 8 eps s, the normal by 8 eps over the sine between the two shortest
    edges, texture coordinates by 32 eps s over the least height and c.
    """
    rounding = EPS * _largest(shape, found.origin)
    off_plane = abs(float(np.dot(found.position - true.position, true.normal)))
    turned_by = float(np.abs(found.normal - true.normal).max())
    moved = float(np.abs(found.uv - true.uv).max())
    return max(
        off_plane / (ROUNDINGS * rounding),
        turned_by * _widest_sine(shape) / (ROUNDINGS * EPS),
        moved * least_height(shape) * _cosine(true, found.direction) / (ROUNDINGS_OF_UV * rounding),
    )


def _widest_sine(shape: Any) -> float:
    first, second = sorted(edges(shape), key=np.linalg.norm)[:2]
    return float(np.linalg.norm(np.cross(first, second)) / np.linalg.norm(first) / np.linalg.norm(second))


def round_details(shape: Any, true: Answer, found: Found) -> float:
    """Error of place, normal and texture coordinates of an ellipsoid, in shares of what is right.

    The place may be off by 8 eps s across the surface and by that over c along it. From one end of the
    longitude to the other is no distance.
    """
    place = ROUNDINGS * EPS * _largest(shape, found.origin)
    step = place / _cosine(true, found.direction)
    _, slide = _steepness(shape, true.normal)
    off = found.position - np.array(true.position)
    across, along = np.abs(found.uv - true.uv)
    mapped = (ROUNDINGS_OF_NORMALS * EPS + step * slide) / math.sin(math.pi * true.uv[1])
    errors = (
        abs(float(np.dot(off, true.normal))) / place,
        float(np.linalg.norm(off)) / step,
        angle(found.normal, true.normal) / turned(shape, true, found.origin, found.direction, EPS),
        2 * math.pi * min(across, 1 - across) / mapped,
        math.pi * along / mapped,
    )
    return float(max(errors))


def turned(shape: Any, true: Answer, origin: Floats, direction: Floats, eps: float) -> float:
    """Angle that the normal may be off by, radians: 16 eps, and what the place's uncertainty turns it by."""
    step = ROUNDINGS * eps * _largest(shape, origin) / _cosine(true, direction)
    turn, _ = _steepness(shape, true.normal)
    return ROUNDINGS_OF_NORMALS * eps + step * turn


def _steepness(shape: Any, normal: Any) -> tuple[float, float]:
    """How far a step along the surface turns the normal, and how far it goes on the unit sphere.

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
