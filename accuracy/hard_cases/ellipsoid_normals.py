"""Hard cases: normals and texture coordinates of ellipsoids."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases import oracle, rays_seen
from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, ellipsoid, scene
from accuracy.hard_cases.draws import Ray
from accuracy.hard_cases.round_families import ROUND
from accuracy.hard_cases.round_formulas import quadratic
from accuracy.hard_cases.round_tolerances import angle, semi_axes, turned
from renderer.math.arrays import Floats, Pairs
from renderer.math.numerics import EPS
from schemas.reading import read_scene

SECTION = Section("Ellipsoids")

PRECISIONS: list[tuple[type[np.floating], float]] = [
    (dtype, float(np.finfo(dtype).eps)) for dtype in (np.float64, np.float32)
]


@SECTION.case(
    "normals of flat ellipsoids",
    symptom="A lens or a coin made of an ellipsoid is lit as if it were a needle, or from its other side.",
    cause="The matrix that makes the sphere an ellipsoid turns normals towards the longest axes: with "
    "semi-axes of 1, 1 and 1e-6, (0.6, 0, 0.8) becomes (0.6, 0, 8e-7).",
    remedy="Normals go through the inverse transposed; mirrored axes do not turn them over.",
    expected="On the outer side, within 16 eps and what 8 roundings of the place, over the cosine, turn the "
    "normal by.",
    source="Turkowski 1990, Properties of Surface-Normal Transformations, Graphics Gems",
)
def normals() -> Outcome:
    """Semi-axes down to a millionth of the longest, half of them mirrored."""
    return total(_normals(*case) for case in ROUND["flat ellipsoids from outside"]())


def _normals(document: Json, rays: list[Ray]) -> Outcome:
    shape = read_scene(scene(document))[0].shapes[0]
    origins, directions = (np.array(part).T for part in zip(*rays, strict=True))
    points = rays_seen.points(rays_seen.plan_of(scene(document)), origins, directions)
    wrong, worst = np.zeros(3, dtype=int), 0.0
    for number, ray in enumerate(points.rays.tolist()):
        true = oracle.answer(shape, *rays[ray])
        found = points.normals[:, number] * (-1.0 if points.flipped[number] else 1.0)
        given = [(found, EPS), *((by_the_axes(shape, true, dtype), eps) for dtype, eps in PRECISIONS)]
        shares = [
            angle(normal, true.normal) / turned(shape, true, origins[:, ray], directions[:, ray], eps)
            for normal, eps in given
        ]
        wrong += [not share <= 1 for share in shares]
        worst = max(worst, shares[0] if shares[0] <= 1 else 0.0)
    ours, double, single = wrong.tolist()
    return Outcome(points.count, ours, double, single, worst)


def by_the_axes(shape: Any, true: Answer, dtype: type[np.floating]) -> Floats:
    """The normal at the true place as if it were a place: the sphere's, through the matrix of the axes."""
    axes = semi_axes(shape).astype(dtype)
    rows = axes / (axes * axes).sum(axis=1)[:, None]
    place = rows @ (np.array(true.position) - np.array(shape.center)).astype(dtype)
    return np.asarray(place @ axes / np.sqrt((place @ axes) @ (place @ axes)), dtype=np.float64)


ANGLES = [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12, 1e-15, 0.0]
"""Sines of polar angles."""
BESIDE = [0.0, 1e-20, 1e-17, 2.0**-53, 2.0**-52, 1e-9]
"""Sines of longitudes on both sides of the seam."""


@SECTION.case(
    "texture coordinates at the poles",
    symptom="The picture on a ball is torn to rings at its poles, or has a line of wrong texels at its seam.",
    cause="The arc cosine of 1 - x keeps half the digits of a small x, and is NaN beyond 1; a longitude just "
    "below 0 is 1 modulo 1, a column beyond the last.",
    remedy="Latitude is the angle of (height, distance from the axis), by atan2; longitude is 0 at a pole "
    "and where it would round to 1.",
    expected="u from 0 and below 1; u, and v from the lower pole, within 4 eps of themselves; 1 - v within "
    "4 eps of 1.",
    source="geometry",
)
def poles() -> Outcome:
    """Rays along the third axis, down to a polar angle of 1e-15, and on it."""
    return total(_poles(turn, side) for turn in range(3) for side in (-1, 1))


def _poles(turn: int, side: int) -> Outcome:
    """Rays from below or above at an ellipsoid whose third axis is x, y or z; all axes are powers of two."""
    semi = np.array([1.0, 2.0, 0.5])
    shape = np.roll(np.diag(semi), turn, axis=1)
    where = np.array([(sine * x, sine * y) for sine in ANGLES for x, y in _around()])
    starts = np.roll(np.column_stack((where * semi[:2], np.full(len(where), 3.0 * side))), turn, axis=1)
    ways = np.roll(np.broadcast_to([0.0, 0.0, -side], starts.shape), turn, axis=1)
    document = scene(ellipsoid([0, 0, 0], *shape.tolist()))
    found = renderer.trace(renderer.compile_scene(renderer.load_scene(document)), starts, ways).uv
    true = [_exact(x, y, side) for x, y in where.tolist()]
    one = read_scene(document)[0].shapes[0]
    plain = [by_arc_cosine(one, starts.astype(dtype), ways.astype(dtype)) for dtype, _ in PRECISIONS]
    given = [(found, EPS), *((uv, eps) for uv, (_, eps) in zip(plain, PRECISIONS, strict=True))]
    wrong = [sum(not right(*pair, eps) for pair in zip(uv.tolist(), true, strict=True)) for uv, eps in given]
    return Outcome(len(true), *wrong)


def _around() -> Iterator[tuple[float, float]]:
    """Unit vectors to all sides, to rounding, and on both sides of the seam."""
    for angle_ in np.arange(12) * np.pi / 6 + 0.1:
        yield math.cos(angle_), math.sin(angle_)
    for x, y, sign in itertools.product((-1.0, 1.0), BESIDE, (-1.0, 1.0)):
        yield x, sign * y


def _exact(x: float, y: float, side: int) -> tuple[float, float]:
    with mpmath.workprec(200):
        u = mpmath.atan2(y, x) / (2 * mpmath.pi) if x or y else mpmath.mpf(0)
        v = mpmath.asin(mpmath.hypot(x, y)) / mpmath.pi
        return float(u + 1 if u < 0 else u), float(v if side < 0 else 1 - v)


def right(found: list[float], true: tuple[float, float], eps: float) -> bool:
    """Whether texture coordinates are within 4 eps of themselves. The ends of u are one place."""
    across, along = (abs(x - y) for x, y in zip(found, true, strict=True))
    rooms = [4 * eps * size for size in true]
    return 0 <= found[0] < 1 and min(across, 1 - across) <= rooms[0] and along <= rooms[1]


def by_arc_cosine(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """Texture coordinates (N, 2) of textbooks: longitude modulo a turn, and the arc cosine of the height."""
    axes = semi_axes(shape).astype(origins.dtype)
    with np.errstate(all="ignore"):
        t = quadratic(shape, origins, directions)
        x, y, z = ((origins + t[:, None] * directions) @ (axes / (axes * axes).sum(axis=1)[:, None]).T).T
        return np.column_stack((np.arctan2(y, x) / (2 * np.pi) % 1, np.arccos(-z) / np.pi))
