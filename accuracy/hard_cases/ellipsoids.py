"""Hard cases D: what rays hit of ellipsoids and where; normals, texture coordinates, outlines and sizes."""

import itertools
import math
import random
from collections.abc import Iterable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases import oracle
from accuracy.hard_cases.documents import Json, camera, ellipsoid, phong, sampled, scene, sphere
from accuracy.hard_cases.families import ROUND, Drawn, Ray, direction, family, listed, of_axes
from accuracy.hard_cases.formulas import boxed_quadratic, quadratic
from accuracy.hard_cases.harness import (
    DOUBLE,
    EPS,
    QUALITIES,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    eps_of,
    exact,
    in_both,
    judged,
    points,
    problems_of,
    refused_at,
    tally,
    traced,
)
from accuracy.hard_cases.oracle import Answer
from accuracy.hard_cases.scoring import (
    DOUBLE_TOLERANCE,
    EXCUSED,
    Tolerance,
    angle,
    of_the_axes,
    round_details,
    rounded,
    semi_axes,
    tried,
    turned,
)
from renderer.math.arrays import Floats, Masks, Pairs
from schemas.reading import read_scene

ROUNDED = rounded(np.float64)


def _tried(name: str, double: Tolerance = DOUBLE_TOLERANCE) -> Outcomes:
    return tried(ROUND[name](), quadratic, double=double, details=round_details)


TOUCHING = 16
"""Roundings of the start, in radii, by which a line may pass inside of the sphere that it touches."""


def exactly_tangent() -> Outcomes:
    """From 1 to a million radii away."""
    double, single = touching(np.float64), touching(np.float32)
    return tried(family("exactly tangent", in_tangent_planes), quadratic, double=double, single=single)


def touching(dtype: type[np.floating]) -> Tolerance:
    """Error of t where a line touches: half the chord of one that passes inside by some roundings."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del true
        axes = semi_axes(shape)
        rows = axes / (axes * axes).sum(axis=1)[:, None]
        away, length = (math.hypot(*(rows @ v)) for v in (origin - np.array(shape.center), direction))
        return math.sqrt(TOUCHING * eps_of(dtype) * away) / length

    return Tolerance(dtype, allowed)


RADIUS = 25.0
ON_SPHERE = [(7, 24, 0), (15, 20, 0), (9, 12, 20), (12, 15, 16), (25, 0, 0)]
"""Whole numbers whose squares add up to that of the radius."""


def placed_exactly(chosen: random.Random) -> tuple[Json, Floats, Floats]:
    """An ellipsoid, a place exactly on it, and a vector along the normal there, (3,) each.

    All are whole numbers times powers of two. The frame has rows of one length by Euler's parametrisation of
    rotations.
    """
    a, b, c, d = (chosen.randint(low, 3) for low in (-3, -3, -3, 1))
    rows = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
    place = np.array(chosen.sample(chosen.choice(ON_SPHERE), 3)) * [chosen.choice([-1, 1]) for _ in range(3)]
    middle = np.array([chosen.randint(-50, 50) for _ in range(3)])
    powers = 2.0 ** np.array([chosen.randint(-3, 3) for _ in range(3)])
    shape = of_axes(middle, RADIUS * powers[:, None] * rows)
    return shape, middle + (place * powers) @ rows, (place / powers) @ rows


def in_tangent_planes(chosen: random.Random) -> Drawn:
    """Rays in tangent planes through the place where these touch, from up to some million radii away."""
    shape, place, normal = placed_exactly(chosen)

    def ray() -> Ray:
        along = np.cross(normal, [chosen.randint(-9, 9) for _ in range(3)])
        along = along if along.any() else np.cross(normal, normal[[1, 2, 0]])
        return listed(place - 2.0 ** chosen.randint(0, 16) * along), listed(along)

    return shape, ray


def from_the_surface(chosen: random.Random) -> Drawn:
    """Rays in all directions from places exactly on ellipsoids."""
    shape, place, _ = placed_exactly(chosen)
    return shape, lambda: (listed(place), direction(chosen))


def normals() -> Outcomes:
    """Semi-axes down to a millionth of the longest, half of them mirrored."""
    return (_normals(*case) for case in ROUND["flat, from outside"]())


def _normals(document: Json, rays: list[Ray]) -> Outcome:
    shape = read_scene(scene(document))[0].shapes[0]
    origins, directions = (np.array(part).T for part in zip(*rays, strict=True))
    found = points(compiled(scene(document), DOUBLE), origins, directions)
    true = [oracle.answer(shape, *rays[ray]) for ray in found.rays.tolist()]

    def errors(normals: Iterable[Floats], eps: float) -> Floats:
        ways = zip(true, origins[:, found.rays].T, directions[:, found.rays].T, normals, strict=True)
        return np.array([angle(n, each.normal) / turned(shape, each, o, d, eps) for each, o, d, n in ways])

    outer = (found.normals * np.where(found.flipped, -1.0, 1.0)).T
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


CASES: Cases = {
    "D1: tiny spheres far away": lambda: _tried("tiny spheres far away"),
    "D2: a giant sphere as the ground": lambda: _tried("the ground", of_the_axes(4, np.float64)),
    "D3: starts close to the surface": lambda: _tried(
        "from close to the surface", of_the_axes(16, np.float64)
    ),
    "D4: axes a million to one": lambda: map(_tried, ("axes far apart", "thin and far away")),
    "D5: centres far from the origin": lambda: _tried("far from the origin"),
    "D6: starts inside": lambda: _tried("from inside", ROUNDED),
    "D8: nearly tangent rays": lambda: _tried("nearly tangent"),
    "D10: ellipsoids behind the start": lambda: tried(ROUND["behind"](), quadratic, double=ROUNDED),
    "D11: directions of any length": lambda: (
        _tried(name, ROUNDED) for name in ("long and short directions", "extreme directions")
    ),
    "D12: zero and negative zero components": lambda: tried(
        ROUND["directions with zeros"](), boxed_quadratic, details=round_details
    ),
    "D7: exactly tangent rays": exactly_tangent,
    "D9: starts on the surface": lambda: tried(
        family("from the surface", from_the_surface), quadratic, double=ROUNDED, details=round_details
    ),
    "D13: normals of flat ellipsoids": normals,
    "D15: texture coordinates at the poles": lambda: (
        _poles(turn, side) for turn in range(3) for side in (-1, 1)
    ),
    "D8: outlines in both precisions": lambda: (_outline(10.0**k) for k in range(1, 7)),
    "D14: semi-axes that make no ellipsoid": no_ellipsoids,
}
