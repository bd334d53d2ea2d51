"""Hard cases: outlines of ellipsoids in both precisions, and semi-axes that make none."""

import math
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

import renderer
from accuracy.hard_cases import oracle
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, camera, ellipsoid, phong, sampled, scene, sphere
from accuracy.hard_cases.round_formulas import quadratic
from accuracy.hard_cases.scoring import DOUBLE, SINGLE
from accuracy.hard_cases.small_scenes import DOUBLE as DOUBLE_QUALITY
from accuracy.hard_cases.small_scenes import SINGLE as SINGLE_QUALITY
from accuracy.hard_cases.small_scenes import image_of, plan_of
from accuracy.hard_cases.written_scenes import refused_at
from schemas.errors import SceneError
from schemas.reading import read_scene

SECTION = Section("Ellipsoids")


@SECTION.case(
    "outlines in both precisions",
    symptom="The outline of a ball is another one in a quick picture than in an exact one.",
    cause="The discriminant decides there, and float32 keeps few digits of it.",
    remedy="Single precision is for light and shadow; which shape a pixel sees is float64 in both.",
    expected="In both precisions, a pixel shows the ball if exact arithmetic says that its ray meets it, but "
    "within 16 eps of the outline.",
    source="geometry",
)
def outlines() -> Outcome:
    """Balls that fill the picture, from near and from far away."""
    return total(_outline(10.0**k) for k in range(1, 7))


def _outline(distance: float) -> Outcome:
    """Pixels of a ball of radius 1 on black, in two precisions and by the plain formula."""
    document = _ball(distance)
    plan, shape = plan_of(document), read_scene(document)[0].shapes[0]
    pixels = np.arange(plan.width * plan.height)
    down, across = np.divmod(pixels, plan.width)
    start, ways = plan.camera.rays(across + 0.5, down + 0.5, pixels, np.zeros_like(pixels))
    origins, directions = np.broadcast_to(start, ways.shape).T, ways.T
    true = [oracle.answer(shape, *ray) for ray in zip(origins, directions, strict=True)]
    hit, margin = np.array([answer.hit for answer in true]), np.array([answer.margin for answer in true])
    wrong, plain = 0, []
    for quality in (SINGLE_QUALITY, DOUBLE_QUALITY):
        shown = image_of(document, quality).max(axis=2).ravel() > 0
        wrong += int(np.count_nonzero((shown != hit) & (margin > DOUBLE.margin)))
    for tolerance in (DOUBLE, SINGLE):
        with np.errstate(all="ignore"):
            t = quadratic(shape, origins.astype(tolerance.dtype), directions.astype(tolerance.dtype))
        plain.append(int(np.count_nonzero((np.isfinite(t) != hit) & (margin > tolerance.margin))))
    return Outcome(2 * pixels.size, wrong, *plain)


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
    """Shapes that are none, and where that is to be told."""
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
    "semi-axes that make no ellipsoid",
    symptom="A ball whose radius is 0, -1 or NaN is drawn as something, or fills the picture with NaN.",
    cause="A semi-axis is divided by its squared length, which is 0 for 0 and for 1e-200, and 1 for a radius "
    "of -1.",
    remedy="Radii and semi-axes are from 1e-100 to 1e15 long, semi-axes perpendicular to 1e-6. There is a "
    "warning where one is more than 1e8 times as long as another. Any may point the other way.",
    expected="Refused at its place, in all axes alike. What is rare, but right, is read, and met from its "
    "centre with t within 1e-10 of itself.",
    source="geometry",
)
def no_ellipsoids() -> Outcome:
    """Wrong is what is taken, told elsewhere or not met; of the plain formula, whatever is no miss."""
    wrong = sum(not refused_at(scene(shape), place) for shape, place in refused())
    plain = [
        sum(_is_met_plainly(shape, tolerance.dtype) for shape, _ in refused())
        for tolerance in (DOUBLE, SINGLE)
    ]
    wrong += sum(not _is_right(shape, warned) for shape, warned in accepted())
    return Outcome(len(refused()) + len(accepted()), wrong, *plain)


def _is_right(document: Json, warned: bool) -> bool:
    """Whether a shape is read, warned of as it should be, and met from its centre."""
    written, center, way = scene(document), [0.0, 0.0, 0.0], [0.3, -0.4, 0.5]
    try:
        read, warnings = read_scene(written)
    except SceneError:
        return False
    t = renderer.trace(renderer.compile_scene(renderer.load_scene(written)), [center], [way]).t[0]
    true = oracle.answer(read.shapes[0], center, way).t
    told = any(warning.code == "very_flat" for warning in warnings)
    return told == warned and bool(abs(t - true) <= 1e-10 * true)


def _is_met_plainly(document: Json, dtype: type[np.floating]) -> bool:
    """Whether the formula says of a ray along (1, 1, 1) anything else than that it misses."""
    shape, ray = SimpleNamespace(**document), np.ones((1, 3), dtype)
    with np.errstate(all="ignore"):
        t = quadratic(shape, -3 * ray, ray)
    return not bool(np.isinf(t[0]))
