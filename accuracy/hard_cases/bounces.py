"""Hard cases: mirrors and glass."""

from collections import Counter

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases.cases import Outcome, Section
from accuracy.hard_cases.documents import Json, camera, phong, rectangle, scene, sphere, triangle
from accuracy.hard_cases.plain_glass import endless, plain_fresnel, plain_meetings, true_fresnel
from accuracy.hard_cases.solids import turned_box
from renderer.integrator import local_radiance
from renderer.interaction import Rays
from renderer.materials.optics import fresnel, refracted
from renderer.math.arrays import Floats, Pairs, dot, unit
from renderer.math.numerics import EPS
from renderer.waves import Wave, camera_wave
from schemas.quality import FixedQuality

SECTION = Section("Mirrors and glass")
UNSEEN = 2.0**-24
"""Radiance that a path which ends could add at most, as the scene language says; none here is above 1."""

PRECISIONS: tuple[type[np.floating], ...] = (np.float64, np.float32)
DOUBLE = FixedQuality(mode="fixed", precision="double")
UP = np.array([[0.0], [1.0], [0.0]])
GLASS = phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5, max_depth=64)


def waves(document: Json, origins: Floats, directions: Floats) -> list[Wave]:
    """All waves of rays (3, N), each after its ancestors."""
    plan = renderer.compile_scene(renderer.load_scene(document), DOUBLE)
    numbers = np.arange(directions.shape[1])
    waiting, done = [camera_wave(Rays(origins, directions, numbers, np.zeros_like(numbers)))], []
    while waiting:
        wave = waiting.pop()
        _, points = local_radiance(plan, wave.rays, Counter())
        done.append(wave)
        for spawner in plan.spawners:
            waiting.extend(spawner.run(points, wave))
    return done


def through(document: Json, origins: Floats, directions: Floats) -> list[Wave]:
    """The rays that were only ever refracted: the camera's, those inside, those behind, and so on.

    For clear glass seen at angles where it reflects less than half.
    """
    chain = waves(document, origins, directions)
    ways = {0: chain[0]}
    for wave in chain[1:]:
        if wave.depth - 1 in ways and wave.weights.min() > 0.5:
            ways[wave.depth] = wave
    return [ways[depth] for depth in sorted(ways)]


def beyond(shares: Pairs, cosines: Pairs, ratio: float, eps: float) -> int:
    """Shares that no cosine within 4 eps of the given one has, up to 4 eps of 1; NaN is one of them."""
    wrong = 0
    for share, cosine in zip(shares, cosines, strict=True):
        steep, flat = (true_fresnel(min(max(float(cosine) + s * 4 * eps, 0), 1), ratio) for s in (1, -1))
        low, high = min(steep, flat), max(steep, flat)
        wrong += not low - 4 * eps <= share <= high + 4 * eps
    return wrong


@SECTION.case(
    "the critical angle",
    symptom="Black or white dots on a ring inside of glass.",
    cause="Just at the angle the square of the refracted cosine comes out as -1e-16, whose root is NaN.",
    remedy="The square is taken as 0 where it is negative, which makes the reflected share exactly 1.",
    expected="Finite directions; shares between those of cosines 4 eps to either side, to 4 eps; 1 beyond.",
    source="Born and Wolf, Principles of Optics, 1.5; geometry (from index 1.5 to 1 the sine is 2/3)",
)
def critical_angle() -> Outcome:
    """From inside, at cosines down to a rounding of the critical one, and on both sides of it."""
    steps = np.concatenate([side * 10.0 ** np.arange(-17, -0.9, 0.25) for side in (-1, 1)] + [[0.0]])
    cosines = np.sqrt(5) / 3 + steps
    viewers = np.stack((np.sqrt(1 - cosines * cosines), cosines, np.zeros(cosines.size)))
    ratio = np.full(cosines.size, 1.5)
    shares, directions = fresnel(viewers, UP, ratio), refracted(viewers, UP, UP, ratio)
    wrong = beyond(shares, cosines, 1.5, EPS) + np.count_nonzero(~np.isfinite(directions).all(axis=0))
    return Outcome(2 * cosines.size, int(wrong), *(_plain_shares(cosines, dtype) for dtype in PRECISIONS))


def _plain_shares(cosines: Floats, dtype: type[np.floating]) -> int:
    given = cosines.astype(dtype)
    with np.errstate(invalid="ignore"):
        shares = plain_fresnel(given, np.full(given.size, 1.5, dtype))
    return beyond(shares.astype(np.float64), given.astype(np.float64), 1.5, float(np.finfo(dtype).eps))


@SECTION.case(
    "facing mirrors",
    symptom="A render that never ends, or stops for want of memory, where two mirrors face each other.",
    cause="Every bounce asks for another one.",
    remedy="A material bounds the number of bounces, and a path ends that can add 2^-24 at most.",
    expected="Each pixel is the geometric sum of its bounces to 1e-13 relative, and each bounce is counted.",
    source="Whitted 1980, An improved illumination model for shaded display; Hall and Greenberg 1983",
)
def facing_mirrors() -> Outcome:
    """A camera between two mirrors that fill its view, without light but the ambient."""
    tried = wrong = lost = 0
    for strength in (1.0, 0.9, 0.5, 0.001):
        for depth in (1, 7, 64):
            result = renderer.render(_corridor(strength, depth), DOUBLE)
            bounces = min(depth, sum(strength**k > UNSEEN for k in range(1, 65)))
            one = np.array([0.8 * 1, 0.7 * 0.9, 0.6 * 0.8]) * 0.2
            expected = (one * sum(strength**k for k in range(bounces + 1))).astype(np.float32)
            # The picture is float32: its own rounding, and one for the sum.
            far = np.abs(result.image - expected) > np.spacing(expected)
            pixels = far.any(axis=2)
            wrong += np.count_nonzero(pixels) + (result.report["rays"]["mirror"] != bounces * pixels.size)
            tried += pixels.size + 1
            try:
                endless(one[0], strength)
            except RecursionError:
                lost += pixels.size + 1
    return Outcome(tried, int(wrong), lost)


def _corridor(strength: float, depth: int) -> renderer.RenderPlan:
    walls = [rectangle([-50, -50, z], [100, 0, 0], [0, 100, 0]) for z in (-1, 1)]
    view = camera(position=[0, 0, 0.5], look_at=[0.02, 0.01, 0], vertical_fov=4, width=6, height=4)
    materials = {"plain": phong(mirror=strength, max_depth=depth)}
    return renderer.compile_scene(renderer.load_scene(scene(*walls, materials=materials, camera=view)))


SPHERES = [(radius, place) for radius in (1e-6, 1.0, 1e4) for place in (0.0, 1e3)]


@SECTION.case(
    "a ray that leaves glass",
    symptom="Glass balls that are black, or show no inside, in a model of small or large units.",
    cause="The start of the inner ray is moved by a length, or hits nearer than a length are dropped; the "
    "other side may be nearer.",
    remedy="No ray is moved: a shape knows the rays that begin on it, and to which side they go.",
    expected="Every ray meets a ball exactly twice, whatever its size and place; behind a unit ball at the "
    "origin each component of the direction is right to 32 eps, 16 a bounce.",
    source="geometry (a ray through a ball turns by twice the difference of its two angles)",
)
def leaving_glass() -> Outcome:
    """Parallel rays at balls, up to 0.8 of the radius from the middle."""
    rng = np.random.default_rng(1)
    tried, wrong, plain = 0, 0, [0, 0]
    turns, away = rng.uniform(0, 2 * np.pi, 200), np.sqrt(rng.uniform(0, 0.64, 200))
    directions = np.broadcast_to([[0.0], [0.0], [-1.0]], (3, 200)).copy()
    for radius, place in SPHERES:
        center = np.full((3, 1), place)
        origins = center + radius * np.stack((away * np.cos(turns), away * np.sin(turns), np.full(200, 3.0)))
        ball = scene(sphere(center[:, 0].tolist(), radius), materials={"plain": GLASS})
        chain = through(ball, origins, directions)
        met = np.zeros(200, dtype=np.int64)
        for wave in chain:
            met[wave.targets] += np.isfinite(wave.rays.t)
        tried, wrong = tried + 200, wrong + int(np.count_nonzero(met != 2))
        if (radius, place) == (1.0, 0.0):
            tried, wrong = tried + 200, wrong + _wrong_turns(chain[2], origins)
        for i, dtype in enumerate(PRECISIONS):
            places = center.astype(dtype), origins.astype(dtype)
            with np.errstate(all="ignore"):
                counts = plain_meetings(places[0], dtype(radius), places[1], directions.astype(dtype))
            plain[i] += int(np.count_nonzero(counts != 2))
    return Outcome(tried, wrong, *plain)


def _wrong_turns(behind: Wave, origins: Floats) -> int:
    """Directions behind a unit ball of index 1.5 that are off by more than 16 eps a bounce."""
    wrong = 0
    for target, got in zip(behind.targets, behind.rays.directions.T, strict=True):
        x, y = (mpmath.mpf(v) for v in origins[:2, target])
        height = mpmath.sqrt(x * x + y * y)
        turn = 2 * (mpmath.asin(height) - mpmath.asin(height / 1.5))
        aside = -mpmath.sin(turn) / height
        wanted = (aside * x, aside * y, -mpmath.cos(turn))
        wrong += max(abs(mpmath.mpf(got[i]) - wanted[i]) for i in range(3)) > 2 * 16 * EPS
    return wrong


@SECTION.case(
    "the edge of a glass block",
    symptom="A line of wrong pixels along the edge of a glass block that stands in the very middle of "
    "the picture.",
    cause="At the edge a ray meets two faces in one place, and is bent by both.",
    remedy="A face that a ray passes in the place where it passed another of the same glass, the same way, "
    "bends nothing more.",
    expected="Inside, the direction by Snell's law of the one face or of the other, to 16 eps a component.",
    source="geometry (beside the edge there is one face only)",
)
def edge_of_glass() -> Outcome:
    """Turned cubes, seen along the bisector of two faces, more or less."""
    rng = np.random.default_rng(6)
    tried, wrong, plain = 0, 0, [0, 0]
    for place in (0.0, 1e3, 1e6) * 4:
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        center = place + rng.normal(size=3)
        targets = center + np.array([0.5, 0.5, 0]) @ axes + np.outer(rng.uniform(-0.4, 0.4, 75), axes[2])
        eye = center + [3 + rng.uniform(-1, 1), 3, rng.uniform(-1, 1)] @ axes
        ways, normals = unit((targets - eye).T), axes[:2, :, None]
        cube = scene(*turned_box(center, axes, 1.0), materials={"plain": GLASS})
        # The first bounce is at one face, the second at the other.
        inside = [wave for wave in through(cube, np.tile(eye, (75, 1)).T, ways) if wave.depth <= 2][-1]
        bent = np.full((3, 75), np.nan)
        bent[:, inside.targets] = inside.rays.directions
        tried, wrong = tried + 75, wrong + _bent_by_none(bent, ways, normals, EPS)
        for i, dtype in enumerate(PRECISIONS):
            twice = ways.astype(dtype)
            for normal in normals.astype(dtype):
                twice = refracted(-twice, normal, normal, np.full(75, 1 / 1.5, dtype))
            plain[i] += _bent_by_none(twice, ways, normals, float(np.finfo(dtype).eps))
    return Outcome(tried, wrong, *plain)


def _bent_by_none(bent: Floats, ways: Floats, normals: Floats, eps: float) -> int:
    """Directions (3, N) that come of `ways` by Snell's law of neither normal: what lies in a face shrinks."""

    def along(directions: Floats, normal: Floats) -> Floats:
        return directions - dot(directions, normal) * normal

    off = [np.abs(along(bent, normal) - along(ways, normal) / 1.5).max(axis=0) for normal in normals]
    return int(np.count_nonzero(~(np.minimum(*off) <= 16 * eps)))


@SECTION.case(
    "glass of index 1",
    symptom="The outline of a ball of air shines like a ring.",
    cause="1 - (1 - c^2) is not c^2 for a small cosine c, so Fresnel's formulas see two different angles.",
    remedy="The square is written (1 - n)(1 + n) + (n c)^2: for n = 1 the square of the cosine itself.",
    expected="A reflected share of exactly 0 at every angle, and the very picture without the glass.",
    source="geometry (nothing bends or reflects between two parts of one thing)",
)
def index_one() -> Outcome:
    """Cosines down to 1e-12, and a room seen through a ball, a box side and a prism of index 1."""
    cosines = 10.0 ** -np.linspace(0, 12, 500)
    viewers = np.stack((np.sqrt(1 - cosines * cosines), cosines, np.zeros(500)))
    shares = fresnel(viewers, UP, np.ones(500))
    plain = []
    for dtype in PRECISIONS:
        given = cosines.astype(dtype)
        with np.errstate(all="ignore"):
            plain.append(int(np.count_nonzero(plain_fresnel(given, np.ones(500, dtype)) != 0)))
    off = _seen_through_air()
    return Outcome(500 + off.size, int(np.count_nonzero(shares) + np.count_nonzero(off)), *plain)


def _seen_through_air() -> Floats:
    """Largest difference of each pixel with and without things of index 1; ambient light alone."""
    materials = {"plain": phong(), "red": phong([0.9, 0.1, 0.1]), "air": {**GLASS, "ior": 1.0}}
    around = [
        rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0]),
        sphere([-0.5, 1, 0], 0.6, material="red"),
        triangle([0.5, 0.5, 0], [1.5, 0.75, -1], [0.75, 2, 0.5], material="red"),
    ]
    unseen = [
        sphere([0.2, 1.5, 2.5], 0.8, material="air"),
        rectangle([-1, 0.5, 3], [2, 0, 0.3], [0, 1.5, 0.1], material="air"),
        triangle([-2, 0.3, 2], [-0.5, 0.4, 2.5], [-1, 2.2, 1.5], material="air"),
    ]
    images = []
    for shapes in (around, [*around, *unseen]):
        document = scene(*shapes, lights=[], materials=materials, camera=camera(width=48, height=32))
        plan = renderer.compile_scene(renderer.load_scene(document), DOUBLE)
        images.append(renderer.render(plan).image)
    return np.abs(images[0] - images[1]).max(axis=2)
