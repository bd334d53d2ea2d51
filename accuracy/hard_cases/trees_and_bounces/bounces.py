"""Hard cases H: mirrors and glass."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, camera, phong, rectangle, scene, sphere, triangle
from accuracy.hard_cases.formulas import plain_fresnel, plain_hits, true_fresnel
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
    rays_of,
    tally,
)
from accuracy.hard_cases.shadows.plain import STEP
from accuracy.hard_cases.shadows.scenes import (
    EYE,
    PATTERNS,
    WALLS,
    Place,
    corner_targets,
    inner_lights,
    places,
    room,
    seen_in_room,
)
from accuracy.hard_cases.solids import turned_box
from renderer.integrator import local_radiance
from renderer.materials.optics import fresnel, refracted
from renderer.math.arrays import Floats, Integers, Masks, Pairs, dot, unit
from renderer.waves import Wave, camera_wave

UNSEEN = 2.0**-24
"""Radiance that a path which ends could add at most, as the scene language says; none here is above 1."""

UP = np.array([[0.0], [1.0], [0.0]])
GLASS = phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5, max_depth=64)


def waves(document: Json, origins: Floats, directions: Floats) -> list[Wave]:
    """All waves of rays (3, N), each after its ancestors."""
    plan = compiled(document, DOUBLE)
    waiting, done = [camera_wave(rays_of(origins, directions))], []
    while waiting:
        wave = waiting.pop()
        _, points = local_radiance(plan, wave.rays, Counter())
        done.append(wave)
        for stage in plan.scattering:
            waiting.extend(stage.run(points, wave))
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


def critical_angle() -> Outcome:
    """From inside, at cosines down to a rounding of the critical one, and on both sides of it."""
    steps = np.concatenate([side * 10.0 ** np.arange(-17, -0.9, 0.25) for side in (-1, 1)] + [[0.0]])
    cosines = np.sqrt(5) / 3 + steps
    viewers = np.stack((np.sqrt(1 - cosines * cosines), cosines, np.zeros(cosines.size)))
    ratio = np.full(cosines.size, 1.5)
    shares, directions = fresnel(viewers, UP, ratio), refracted(viewers, UP, UP, ratio)
    wrong = beyond(shares, cosines, 1.5, EPS) + tally(~np.isfinite(directions).all(axis=0))
    return Outcome(2 * cosines.size, wrong, *in_both(partial(_plain_shares, cosines)))


def _plain_shares(cosines: Floats, dtype: type[np.floating]) -> int:
    given = cosines.astype(dtype)
    shares = plain_fresnel(given, np.full(given.size, 1.5, dtype))
    return beyond(shares.astype(np.float64), given.astype(np.float64), 1.5, eps_of(dtype))


def facing_mirrors() -> Outcome:
    """A camera between two mirrors that fill its view, without light but the ambient."""
    tried = wrong = 0
    for strength, depth in itertools.product((1.0, 0.9, 0.5, 0.001), (1, 7, 64)):
        result = renderer.render(_corridor(strength, depth), DOUBLE)
        bounces = min(depth, sum(strength**k > UNSEEN for k in range(1, 65)))
        one = np.array([0.8 * 1, 0.7 * 0.9, 0.6 * 0.8]) * 0.2
        expected = (one * sum(strength**k for k in range(bounces + 1))).astype(np.float32)
        # The picture is float32: its own rounding, and one for the sum.
        pixels = (np.abs(result.image - expected) > np.spacing(expected)).any(axis=2)
        wrong += tally(pixels) + (result.report["rays"]["mirror"] != bounces * pixels.size)
        tried += pixels.size + 1
    return Outcome(tried, wrong)


def _corridor(strength: float, depth: int) -> renderer.RenderPlan:
    walls = [rectangle([-50, -50, z], [100, 0, 0], [0, 100, 0]) for z in (-1, 1)]
    view = camera(position=[0, 0, 0.5], look_at=[0.02, 0.01, 0], vertical_fov=4, width=6, height=4)
    materials = {"plain": phong(mirror=strength, max_depth=depth)}
    return compiled(scene(*walls, materials=materials, camera=view))


SPHERES = [(radius, place) for radius in (1e-6, 1.0, 1e4) for place in (0.0, 1e3)]


def leaving_glass() -> Iterator[Outcomes]:
    """Parallel rays at balls, up to 0.8 of the radius from the middle."""
    rng = np.random.default_rng(1)
    turns, away = rng.uniform(0, 2 * np.pi, 200), np.sqrt(rng.uniform(0, 0.64, 200))
    directions = np.broadcast_to([[0.0], [0.0], [-1.0]], (3, 200)).copy()
    for radius, place in SPHERES:
        center = np.full((3, 1), place)
        origins = center + radius * np.stack((away * np.cos(turns), away * np.sin(turns), np.full(200, 3.0)))
        ball = scene(sphere(center[:, 0], radius), materials={"plain": GLASS})
        chain = through(ball, origins, directions)
        hits = np.zeros(200, dtype=np.int64)
        for wave in chain:
            hits[wave.targets] += np.isfinite(wave.rays.t)
        plain = in_both(partial(plain_hits, center, radius, origins, directions))
        yield Outcome(200, *(tally(number != 2) for number in (hits, *plain)))
        if (radius, place) == (1.0, 0.0):
            yield Outcome(200, _wrong_turns(chain[2], origins))


@exact
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


def edge_of_glass() -> Outcome:
    """Turned cubes, seen along the bisector of two faces, more or less."""
    rng = np.random.default_rng(6)
    wrong = 0
    for place in (0.0, 1e3, 1e6) * 4:
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        center = place + rng.normal(size=3)
        targets = center + np.array([0.5, 0.5, 0]) @ axes + np.outer(rng.uniform(-0.4, 0.4, 75), axes[2])
        eye = center + [3 + rng.uniform(-1, 1), 3, rng.uniform(-1, 1)] @ axes
        ways = unit((targets - eye).T)
        cube = scene(*turned_box(center, axes, 1.0), materials={"plain": GLASS})
        # The first bounce is at one face, the second at the other.
        inside = [wave for wave in through(cube, np.tile(eye, (75, 1)).T, ways) if wave.depth <= 2][-1]
        bent = np.full((3, 75), np.nan)
        bent[:, inside.targets] = inside.rays.directions
        wrong += _bent_by_none(bent, ways, axes[:2, :, None])
    return Outcome(12 * 75, wrong)


def _bent_by_none(bent: Floats, ways: Floats, normals: Floats) -> int:
    """Directions (3, N) that come of `ways` by Snell's law of neither normal: what lies in a face shrinks."""

    def along(directions: Floats, normal: Floats) -> Floats:
        return directions - dot(directions, normal) * normal

    off = [np.abs(along(bent, normal) - along(ways, normal) / 1.5).max(axis=0) for normal in normals]
    return tally(~(np.minimum(*off) <= 16 * EPS))


def index_one() -> Outcomes:
    """Cosines down to 1e-12, and a room seen through a ball, a box side and a prism of index 1."""
    cosines = 10.0 ** -np.linspace(0, 12, 500)
    viewers = np.stack((np.sqrt(1 - cosines * cosines), cosines, np.zeros(500)))
    shares = (
        fresnel(viewers, UP, np.ones(500)),
        *in_both(lambda dtype: plain_fresnel(cosines.astype(dtype), np.ones(500, dtype))),
    )
    off = _seen_through_air()
    return [Outcome(500, *(tally(each != 0) for each in shares)), Outcome(off.size, tally(off))]


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
        images.append(renderer.render(compiled(document, DOUBLE)).image)
    return np.abs(images[0] - images[1]).max(axis=2)


DEPTHS = (3, 8, 32)
AXES = ((0,), (0, 2))
"""Axes that a pair of mirrors is across: one pair, and two of them."""

ACROSS = (2, 0, 1)
"""Axis that the walls of a room are across, in their order."""


def facing_corners() -> Iterator[Outcomes]:
    """Rooms with one or two pairs of facing mirrors; the other walls are lit by lights in the room."""
    upright = Place(np.zeros(3), np.eye(3), 1.0)
    for number, (axes, kind) in enumerate(itertools.product(AXES, WALLS)):
        depth, seed = DEPTHS[number % 3], [number, 4]
        ways = corner_targets(np.random.default_rng(seed), 6) - EYE
        dark = bounces(ways, axes) > depth
        plain = [tally(each != dark) for each in in_both(partial(plainly_dark, ways, axes, depth))]
        turned = (place for _, place in places(f"mirrors {kind}", offsets=(1e7,)))
        for place in itertools.chain(turned, [upright]):
            light = seen_in_room(
                room(kind, place, [wall for wall in range(6) if ACROSS[wall % 3] in axes]),
                place,
                np.random.default_rng(seed),
                QUALITIES[number % 2],
                shining=inner_lights(place),
                pattern=PATTERNS[number % 4],
                depth=depth,
            )
            yield Outcome(dark.size, tally((light == 0) != dark), *plain)


def bounces(ways: Floats, axes: Sequence[int]) -> Floats:
    """Mirrors across some axes that are hit on ways (N, 3) from the eye before another wall, (N,).

    By the straight way: the mirror images of a room two units wide have walls at all odd numbers.
    """
    others = [axis for axis in range(3) if axis not in axes]
    with np.errstate(divide="ignore"):
        ends = [(1 - np.sign(ways[:, axis]) * EYE[axis]) / np.abs(ways[:, axis]) for axis in others]
    end = np.minimum.reduce(ends)
    return np.sum([np.floor((np.abs(EYE[axis] + ways[:, axis] * end) + 1) / 2) for axis in axes], axis=0)


def plainly_dark(ways: Floats, axes: Sequence[int], depth: int, dtype: type[np.floating]) -> Masks:
    """Ways (N, 3) on which a textbook that steps over what is near hits no wall but mirrors."""
    along = ways.astype(dtype)
    at = np.broadcast_to(EYE.astype(dtype), along.shape).copy()
    lit = np.zeros(len(along), dtype=bool)
    for _ in range(depth + 1):
        wall, t = _next_wall(at, along)
        inside = np.isfinite(t)
        lit |= inside & ~np.isin(wall, axes)
        at += np.where(inside, t, 0)[:, None] * along
        along = along * np.where(np.arange(3) == wall[:, None], -1, 1).astype(dtype)
        # What is lit or has left the room goes nowhere any more.
        along[lit | ~inside] = np.nan
    return ~lit


def _next_wall(at: Pairs, along: Pairs) -> tuple[Integers, Pairs]:
    """Axis that the next wall of the room is across (N,), and the way there (N,); inf for none."""
    nearest, wall = np.full(len(at), np.inf, dtype=at.dtype), np.zeros(len(at), dtype=np.int64)
    for axis, side in itertools.product(range(3), (-1, 1)):
        t = (side - at[:, axis]) / along[:, axis]
        places = np.delete(at + t[:, None] * along, axis, axis=1)
        hits = (t > STEP) & (np.abs(places) <= 1).all(axis=1) & (t < nearest)
        nearest, wall = np.where(hits, t, nearest), np.where(hits, axis, wall)
    return wall, nearest


CASES: Cases = {
    "H6: the critical angle": critical_angle,
    "H7: facing mirrors": facing_mirrors,
    "H8: a ray that leaves glass": leaving_glass,
    "H12: the edge of a glass block": edge_of_glass,
    "H9: glass of index 1": index_one,
    "H13: corners of facing mirrors": facing_corners,
}
