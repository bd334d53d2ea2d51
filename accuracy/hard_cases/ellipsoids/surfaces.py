"""Hard cases D: normals, texture coordinates, outlines and sizes of ellipsoids."""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases import oracle
from accuracy.hard_cases.documents import Json, camera, ellipsoid, phong, sampled, scene, sphere
from accuracy.hard_cases.families import ROUND, Ray
from accuracy.hard_cases.formulas import quadratic
from accuracy.hard_cases.harness import (
    DOUBLE,
    EPS,
    QUALITIES,
    Outcome,
    Section,
    compiled,
    eps_of,
    exact,
    in_both,
    judged,
    points,
    problems_of,
    refused_at,
    tally,
    total,
    traced,
)
from accuracy.hard_cases.oracle import Answer
from accuracy.hard_cases.scoring import EXCUSED, angle, semi_axes, turned
from renderer.math.arrays import Floats, Masks, Pairs
from schemas.reading import read_scene

SECTION = Section("Ellipsoids")


@SECTION.case(
    "D13: normals of flat ellipsoids",
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
    return total(_normals(*case) for case in ROUND["flat, from outside"]())


def _normals(document: Json, rays: list[Ray]) -> Outcome:
    shape = read_scene(scene(document))[0].shapes[0]
    origins, directions = (np.array(part).T for part in zip(*rays, strict=True))
    met = points(compiled(scene(document), DOUBLE), origins, directions)
    true = [oracle.answer(shape, *rays[ray]) for ray in met.rays.tolist()]

    def errors(normals: Iterable[Floats], eps: float) -> Floats:
        ways = zip(true, origins[:, met.rays].T, directions[:, met.rays].T, normals, strict=True)
        return np.array([angle(n, each.normal) / turned(shape, each, o, d, eps) for each, o, d, n in ways])

    outer = (met.normals * np.where(met.flipped, -1.0, 1.0)).T
    plain = in_both(lambda dtype: errors([by_the_axes(shape, each, dtype) for each in true], eps_of(dtype)))
    return judged(errors(outer, EPS), *plain)


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
    "D15: texture coordinates at the poles",
    symptom="The picture on a ball falls into rings at its poles, or has a line of wrong texels at a seam.",
    cause="The arc cosine of 1 - x keeps half the digits of a small x, and is NaN beyond 1; a longitude just "
    "below 0 is 1 modulo 1, a column beyond the last.",
    remedy="Latitude is the angle of (height, distance from the axis), by atan2; longitude is 0 at a pole "
    "and where it would round to 1.",
    expected="u from 0 and below 1; u, and v from the lower pole, within 4 eps of themselves; 1 - v within "
    "4 eps of 1.",
)
def poles() -> Outcome:
    """Rays along the third axis, down to a polar angle of 1e-15, and on it."""
    return total(_poles(turn, side) for turn in range(3) for side in (-1, 1))


def _poles(turn: int, side: int) -> Outcome:
    """Rays from below or above at an ellipsoid whose third axis is x, y or z; all axes are powers of two."""
    semi = np.array([1.0, 2.0, 0.5])
    where = np.array([(sine * x, sine * y) for sine in ANGLES for x, y in _around()])
    starts = np.roll(np.column_stack((where * semi[:2], np.full(len(where), 3.0 * side))), turn, axis=1)
    ways = np.roll(np.broadcast_to([0.0, 0.0, -side], starts.shape), turn, axis=1)
    shape = ellipsoid([0, 0, 0], *np.roll(np.diag(semi), turn, axis=1))
    read = read_scene(scene(shape))[0].shapes[0]
    true = np.array([exact_coordinates(x, y, side) for x, y in where.tolist()])

    def errors(found: Pairs, eps: float) -> Floats:
        off = np.abs(found - true)
        # The ends of u are one place.
        off[:, 0] = np.minimum(off[:, 0], 1 - off[:, 0])
        inside = (found[:, 0] >= 0) & (found[:, 0] < 1)
        return np.where(inside & (off <= 4 * eps * true).all(axis=1), 0.0, np.inf)

    plain = in_both(
        lambda dtype: errors(by_arc_cosine(read, starts.astype(dtype), ways.astype(dtype)), eps_of(dtype))
    )
    return judged(errors(traced([shape], starts, ways).uv, EPS), *plain)


def _around() -> Iterator[tuple[float, float]]:
    """Unit vectors to all sides, to rounding, and on both sides of the seam."""
    for angle_ in np.arange(12) * np.pi / 6 + 0.1:
        yield math.cos(angle_), math.sin(angle_)
    for x, y, sign in itertools.product((-1.0, 1.0), BESIDE, (-1.0, 1.0)):
        yield x, sign * y


@exact
def exact_coordinates(x: float, y: float, side: int) -> tuple[float, float]:
    """Texture coordinates of the place on a unit sphere at (x, y), above or below."""
    u = mpmath.atan2(y, x) / (2 * mpmath.pi) if x or y else mpmath.mpf(0)
    v = mpmath.asin(mpmath.hypot(x, y)) / mpmath.pi
    return float(u + 1 if u < 0 else u), float(v if side < 0 else 1 - v)


def by_arc_cosine(shape: Any, origins: Pairs, directions: Pairs) -> Pairs:
    """Texture coordinates (N, 2) of textbooks: longitude modulo a turn, and the arc cosine of the height."""
    axes = semi_axes(shape).astype(origins.dtype)
    t = quadratic(shape, origins, directions)
    x, y, z = ((origins + t[:, None] * directions) @ (axes / (axes * axes).sum(axis=1)[:, None]).T).T
    return np.column_stack((np.arctan2(y, x) / (2 * np.pi) % 1, np.arccos(-z) / np.pi))


@SECTION.case(
    "D8: outlines in both precisions",
    symptom="The outline of a ball is another one in a quick picture than in an exact one.",
    cause="The discriminant decides there, and float32 keeps few digits of it.",
    remedy="Single precision is for light and shadow; which shape a pixel sees is float64 in both.",
    expected="In both precisions, a pixel shows the ball if exact arithmetic says that its ray hits it, but "
    "within 16 eps of the outline.",
)
def outlines() -> Outcome:
    """Balls that fill the picture, from near and from far away."""
    return total(_outline(10.0**k) for k in range(1, 7))


def _outline(distance: float) -> Outcome:
    """Pixels of a ball of radius 1 on black, in two precisions and by the plain formula."""
    document = _ball(distance)
    plan, shape = compiled(document), read_scene(document)[0].shapes[0]
    pixels = np.arange(plan.width * plan.height)
    down, across = np.divmod(pixels, plan.width)
    start, ways = plan.camera.rays(across + 0.5, down + 0.5, pixels, np.zeros_like(pixels))
    origins, directions = np.broadcast_to(start, ways.shape).T, ways.T
    true = [oracle.answer(shape, *ray) for ray in zip(origins, directions, strict=True)]
    hit, margin = np.array([answer.hit for answer in true]), np.array([answer.margin for answer in true])

    def wrong(seen: Masks, dtype: type[np.floating]) -> int:
        return tally((seen != hit) & (margin > EXCUSED * eps_of(dtype)))

    def by_the_formula(dtype: type[np.floating]) -> int:
        return wrong(np.isfinite(quadratic(shape, origins.astype(dtype), directions.astype(dtype))), dtype)

    images = [renderer.render(compiled(document, quality)).image for quality in QUALITIES]
    ours = [wrong(image.max(axis=2).ravel() > 0, np.float64) for image in images]
    return Outcome(2 * pixels.size, sum(ours), *in_both(by_the_formula))


def _ball(distance: float) -> Json:
    """A bright ball that fills most of the picture, one ray a pixel."""
    place, angle = [0.0, 0.3 * distance, distance], math.degrees(2.4 / distance)
    return scene(
        sphere([0.01, 0.02, 0.03], 1.0),
        camera=camera(position=place, look_at=[0, 0, 0], vertical_fov=angle),
        background=[0, 0, 0],
        materials={"plain": phong([1, 1, 1], ambient=1)},
        sampling=sampled(1),
    )


TINY, LARGE, BAD = 0.99e-100, 1.01e15, (math.nan, math.inf)
AXES = np.eye(3)


def _with(number: int, axis: Sequence[float]) -> Json:
    """A unit sphere with another vector in place of one of its semi-axes."""
    axes = AXES.tolist()
    axes[number] = list(axis)
    return ellipsoid([0, 0, 0], *axes)


def refused() -> list[tuple[Json, str]]:
    """Shapes that are none, and where that is reported."""
    spheres = [(sphere([0, 0, 0], r), "/radius") for r in (0, -0.0, -1, 1e-320, TINY, LARGE, *BAD)]
    axes = [
        (_with(i, size * AXES[i]), f"/axes/{i}") for i in range(3) for size in (0.0, -0.0, 1e-320, 1e-200)
    ]
    axes += [
        (_with(i, np.where(AXES[i] > 0, size, 0.0).tolist()), f"/axes/{i}/{i}")
        for i in range(3)
        for size in (LARGE, -LARGE, *BAD)
    ]
    aslant = [(_with(i, AXES[i] + 2e-6 * AXES[i - 1]), "/axes") for i in range(3)]
    return [(shape, f"/shapes/0{place}") for shape, place in [*spheres, *axes, *aslant]]


def accepted() -> list[tuple[Json, bool]]:
    """Shapes that are rare, but right, and whether a warning is due."""
    sizes = [(-1.0, False), (1e-8, False), (0.9e-8, True), (1e8, False), (1.1e8, True), (1e-100, True)]
    axes = [(_with(i, size * AXES[i]), warned) for i in range(3) for size, warned in sizes]
    aslant = [(_with(i, AXES[i] + 0.9e-6 * AXES[i - 1]), False) for i in range(3)]
    spheres = [(sphere([0, 0, 0], radius), False) for radius in (1e-100, 1e15)]
    return [*spheres, *axes, *aslant]


@SECTION.case(
    "D14: semi-axes that make no ellipsoid",
    symptom="A ball whose radius is 0, -1 or NaN is drawn as something, or fills the picture with NaN.",
    cause="A semi-axis is divided by its squared length, which is 0 for 0 and for 1e-200, and 1 for a radius "
    "of -1.",
    remedy="Radii and semi-axes are from 1e-100 to 1e15 long, semi-axes perpendicular to 1e-6. There is a "
    "warning where one is more than 1e8 times as long as another. Any may point the other way.",
    expected="Refused at its place, in all axes alike. What is rare, but right, is read, and hit from its "
    "centre with t within 1e-10 of itself.",
)
def no_ellipsoids() -> Outcome:
    """Wrong is what is read, reported elsewhere or missed; of the plain formula, whatever is no miss."""
    wrong = sum(not refused_at(scene(shape), place) for shape, place in refused())
    wrong += sum(not _is_right(shape, warned) for shape, warned in accepted())
    plain = in_both(lambda dtype: sum(_is_hit_plainly(shape, dtype) for shape, _ in refused()))
    return Outcome(len(refused()) + len(accepted()), wrong, *plain)


def _is_right(document: Json, warned: bool) -> bool:
    """Whether a shape is read, warned of as it should be, and hit from its centre."""
    center, way = [0.0, 0.0, 0.0], [0.3, -0.4, 0.5]
    if problems_of(scene(document)):
        return False
    read, warnings = read_scene(scene(document))
    t = traced([document], [center], [way]).t[0]
    true = oracle.answer(read.shapes[0], center, way).t
    reported = any(warning.code == "very_flat" for warning in warnings)
    return reported == warned and bool(abs(t - true) <= 1e-10 * true)


def _is_hit_plainly(document: Json, dtype: type[np.floating]) -> bool:
    """Whether the formula says of a ray along (1, 1, 1) anything else than that it misses."""
    ray = np.ones((1, 3), dtype)
    return not bool(np.isinf(quadratic(SimpleNamespace(**document), -3 * ray, ray)[0]))
