"""Hard cases H: trees of boxes, which must find what asking every triangle finds."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, mesh, phong, rectangle, scene, triangle
from accuracy.hard_cases.harness import (
    Cases,
    Outcome,
    Outcomes,
    compiled,
    in_both,
    plain_only,
    tally,
    traced,
)
from accuracy.hard_cases.shadows.plain import pieces
from accuracy.hard_cases.shadows.scenes import SCALES, Place, grid, places
from renderer.interaction import Rays
from renderer.math.arrays import Floats, Integers, Masks, Pairs
from renderer.math.numerics import finite
from renderer.shapes import woop

Box = tuple[Pairs, Pairs]
"""Least and greatest corner, (3,) each."""

BoxTest = Callable[[Box, Pairs, Pairs], Masks]
"""A box, origins (N, 3) and directions (N, 3) of one dtype, to whether the rays hit the box (N,)."""


def nearest(
    corners: Floats, origins: Floats, directions: Floats, order: Integers | None = None
) -> tuple[Floats, Integers]:
    """Distance and number (N,) of the nearest triangle of (T, 3, 3), inf and -1 for a miss.

    Of equal ones the first that is asked: they are in the order of their numbers, or another (T,).
    """
    t, first = np.full(len(origins), np.inf), np.full(len(origins), -1)
    for number in np.arange(len(corners)) if order is None else order:
        rays, found = _hits(corners[number], origins, directions)
        nearer = found < t[rays]
        t[rays[nearer]], first[rays[nearer]] = found[nearer], number
    return t, first


def nearest_in_hit_boxes(
    corners: Floats, origins: Floats, directions: Floats, is_hit: BoxTest, dtype: type[np.floating]
) -> Floats:
    """Distance (N,) of the nearest triangle, where only those are asked whose box a test in `dtype` hits."""
    start, along = origins.astype(dtype), directions.astype(dtype)
    t = np.full(len(origins), np.inf)
    for face in corners:
        rays, found = _hits(face, origins, directions)
        hit = is_hit(box_of(face, dtype), start[rays], along[rays])
        np.minimum.at(t, rays[hit], found[hit])
    return t


def box_of(triangle: Floats, dtype: type[np.floating]) -> Box:
    """Least and greatest corner of a triangle (3, 3)."""
    return triangle.min(axis=0).astype(dtype), triangle.max(axis=0).astype(dtype)


def nearest_by_entries(
    corners: Floats, origins: Floats, directions: Floats, dtype: type[np.floating]
) -> Floats:
    """Distance (N,) of the nearest triangle, where none is asked whose box begins behind a known hit.

    From the last triangle to the first; boxes begin where arithmetic in `dtype` says.
    """
    start, inverse = origins.astype(dtype), 1 / directions.astype(dtype)
    t = np.full(len(origins), np.inf)
    for face in corners[::-1]:
        sides = [(side - start) * inverse for side in box_of(face, dtype)]
        begins = np.minimum(*sides).max(axis=1)
        rays, found = _hits(face, origins, directions)
        asked = begins[rays] <= t[rays]
        np.minimum.at(t, rays[asked], found[asked])
    return t


def _hits(triangle: Floats, origins: Floats, directions: Floats) -> tuple[Integers, Floats]:
    found = woop.hits(triangle[:, :, None], origins.T, directions.T)
    return found.pairs, found.t


def plain_slabs(box: Box, origins: Pairs, directions: Pairs) -> Masks:
    """The textbook's test: minimum and maximum hand a NaN on, and nothing allows for rounding."""
    first, second = ((side - origins) / directions for side in box)
    near = np.minimum(first, second).max(axis=1)
    far = np.maximum(first, second).min(axis=1)
    return (near <= far) & (far >= 0)


def exact_sides_slabs(box: Box, origins: Pairs, directions: Pairs) -> Masks:
    """A test that drops NaN, but multiplies by rounded inverses and allows for no rounding."""
    inverse = 1 / directions
    first, second = ((side - origins) * inverse for side in box)
    near = np.fmax.reduce(np.fmin(first, second), axis=1)
    far = np.fmin.reduce(np.fmax(first, second), axis=1)
    return (near <= far) & (far >= 0)


STEPS = 1024
"""Coordinates are multiples of 1 / STEPS below 4, so that differences of them are exact in float32 too."""


def loose(corners: Floats, **changes: Any) -> Json:
    """Triangles (T, 3, 3) as a mesh in which no vertex is shared."""
    return mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), **changes)


def lattice(size: int) -> Floats:
    """Triangles (K, 3, 3) of an even net of axis-parallel edges, in three planes: every box is flat."""
    corners = []
    for i, j in itertools.product(range(size), repeat=2):
        a, b, c, d = ([i + x, j + y, 0] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
        corners += [[a, b, c], [a, c, d]]
    flat = np.array(corners, dtype=np.float64)
    return np.concatenate([np.roll(flat, axis, axis=2) for axis in range(3)])


def compared(
    corners: Floats, origins: Floats, directions: Floats, textbook: BoxTest | None = None
) -> Outcome:
    """The renderer's tree, and one with a textbook's test of boxes, against asking every triangle."""
    t, first = nearest(corners, origins, directions)
    hits = traced([loose(corners)], origins, directions)
    number = np.where(hits.shape < 0, -1, hits.primitive)
    plain: list[int] = []
    if textbook is not None:
        asked = in_both(partial(nearest_in_hit_boxes, corners, origins, directions, textbook))
        plain = [tally(found != t) for found in asked]
    return Outcome(len(t), tally((hits.t != t) | (number != first)), *plain)


def in_the_plane_of_a_side() -> Outcomes:
    """Whole and half numbers: in the planes of boxes, on edges, on vertices, and between."""
    rng = np.random.default_rng(2)
    origins = rng.integers(-4, 16, (2000, 3)) / 2
    directions = rng.choice([-1.0, 1.0, 0.5], (2000, 3))
    directions[rng.random((2000, 3)) < 0.6] = 0
    directions[~directions.any(axis=1)] = [0, 0, 1]
    negative = np.copysign(directions, np.where(directions, directions, rng.choice([-1.0, 1.0], (2000, 3))))
    corners = lattice(5)
    return (compared(corners, origins, along, plain_slabs) for along in (directions, negative))


def at_the_edges() -> Outcome:
    """Rays through vertices, where a triangle touches the edges of its box; all numbers exact in float32.

    From up to 4 and up to 4,096 units away, where distances are rounded by more than boxes are widened by.
    """
    rng = np.random.default_rng(3)
    corners = rng.integers(-2 * STEPS, 2 * STEPS, (150, 3, 3)) / STEPS
    targets = corners[rng.integers(0, 150, 4000), rng.integers(0, 3, 4000)]
    origins = rng.integers(-4 * STEPS, 4 * STEPS, (4000, 3)) / STEPS
    origins[::2] *= STEPS
    return compared(corners, origins, targets - origins, exact_sides_slabs)


def in_one_place() -> Iterator[Outcomes]:
    """A thousand equal triangles, a flat mesh, and triangles that are points."""
    rng = np.random.default_rng(4)
    equal = np.broadcast_to([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], (1000, 3, 3))
    points = np.repeat(rng.integers(-8, 8, (300, 1, 3)) / 4, 3, axis=1)
    for corners in (equal, lattice(12)[:288], points):
        targets = corners[rng.integers(0, len(corners), 200)].mean(axis=1)
        origins = targets + rng.integers(-8, 9, (200, 3)) / 4 + [0, 0, 4]
        yield compared(corners, origins, targets - origins)


@dataclass
class Watch:
    """Stage: counts the rays that come to the shapes and are not finite."""

    seen: int = 0

    def run(self, rays: Rays) -> None:
        """Look at a block of rays."""
        self.seen += tally(~(finite(rays.origins) & finite(rays.directions)))


def not_finite() -> Outcome:
    """NaN and both infinities in every component of origins and directions."""
    rng = np.random.default_rng(5)
    corners = rng.integers(-2 * STEPS, 2 * STEPS, (300, 3, 3)) / STEPS
    origins = rng.normal(size=(900, 3)) * 4
    directions = corners[rng.integers(0, 300, 900)].mean(axis=1) - origins
    bad, part = np.arange(900) % 3 == 0, rng.integers(0, 6, 900)
    rays = np.concatenate((origins, directions), axis=1)
    rays[bad, part[bad]] = rng.choice([np.nan, np.inf, -np.inf], tally(bad))
    plan, watch = compiled(scene(loose(corners), lights=[bulb([0.0, 9.0, 0.0])])), Watch()
    hits = renderer.trace(replace(plan, intersectors=(watch, *plan.intersectors)), rays[:, :3], rays[:, 3:])
    alone = renderer.trace(plan, rays[~bad, :3], rays[~bad, 3:])
    wrong = np.isfinite(hits.t[bad]) | (hits.shape[bad] >= 0) | hits.visibility[bad].any(axis=1)
    changed = (hits.t[~bad] != alone.t) | (hits.visibility[~bad] != alone.visibility).any(axis=1)
    # A textbook's test lets some of them into more than half of all boxes.
    plain = (tally(boxes > len(corners) / 2) for boxes in in_both(partial(_visited, corners, rays[bad])))
    return Outcome(900, tally(wrong) + tally(changed) + watch.seen, *plain)


def _visited(corners: Floats, rays: Floats, dtype: type[np.floating]) -> Integers:
    """Boxes of triangles that a textbook's test lets each of rays (N, 6) into, (N,)."""
    given = rays.astype(dtype)
    boxes = (box_of(each, dtype) for each in corners)
    return np.sum([exact_sides_slabs(box, given[:, :3], given[:, 3:]) for box in boxes], axis=0)


def overlapping() -> Iterator[Outcomes]:
    """Triangles in one plane, from up to 200 and up to 12,000 units away."""
    rng = np.random.default_rng(7)
    corners = rng.integers(-2 * STEPS, 2 * STEPS, (60, 3, 3)) / STEPS
    corners[..., 2] = 0.5
    targets = np.concatenate((corners.mean(axis=1)[:, :2], np.full((60, 1), 0.5)), axis=1)
    for away in (64, 4096):
        origins = np.round(rng.normal(size=(1500, 3)) * away)
        directions = np.round(targets[rng.integers(0, 60, 1500)] * STEPS) / STEPS - origins
        t, _ = nearest(corners, origins, directions)
        plain = in_both(partial(nearest_by_entries, corners, origins, directions))
        yield [
            compared(corners, origins, directions),
            plain_only(*(tally(each != t) for each in plain)),
        ]


def equal_distances() -> Outcome:
    """Every triangle three times, once in the opposite order."""
    rng = np.random.default_rng(6)
    once = rng.integers(-2 * STEPS, 2 * STEPS, (80, 3, 3)) / STEPS
    thrice = np.concatenate((once, once[::-1], once))
    origins = rng.normal(size=(2000, 3)) * 4
    directions = once[rng.integers(0, 80, 2000)].mean(axis=1) - origins
    _, first = nearest(thrice, origins, directions)
    _, by_tree = nearest(thrice, origins, directions, order=_leaf_order(thrice))
    together = traced([loose(thrice)], origins, directions).primitive
    apart = traced([loose(thrice[i::2]) for i in (0, 1)], origins, directions)
    numbers = 2 * apart.primitive + apart.shape
    in_two = nearest(np.concatenate((thrice[::2], thrice[1::2])), origins, directions)[1]
    lowest = np.where(in_two < 120, 2 * in_two, 2 * (in_two - 120) + 1)
    wrong = tally(together != first) + tally(numbers != lowest)
    pixels = _two_colors(once)
    return Outcome(4000 + pixels.size, wrong + tally(pixels), tally(by_tree != first))


def _leaf_order(corners: Floats) -> Integers:
    """Numbers in the order of a textbook's walk: a stack, so that the last child comes first."""
    return np.argsort(corners.mean(axis=1)[:, 0], kind="stable")[::-1]


def _two_colors(corners: Floats) -> Masks:
    """Pixels that a second mesh in the same place changes."""
    materials = {"plain": phong(), "other": phong([0.1, 0.9, 0.2])}
    view = camera(position=[0.3, 1.0, 8.0], look_at=[0, 0, 0], width=40, height=30)
    images = []
    for shapes in ([loose(corners)], [loose(corners), loose(corners[::-1], material="other")]):
        document = scene(*shapes, lights=[bulb([1.0, 7.0, 5.0])], materials=materials, camera=view)
        plan = compiled(document)
        images.append(renderer.render(plan, tile_size=5 * len(shapes)).image)
    return (images[0] != images[1]).any(axis=2)


KINDS = ("rectangle", "triangle", "small mesh", "large mesh")
"""Of what lies in the plane of a rectangle; only the large mesh is in a tree."""

CORNERS = np.array([[-0.7, -0.9], [1.0, -0.4], [0.1, 0.8]])
"""A triangle in the middle of all of them, across and along."""


def overlapping_shapes() -> Iterator[Outcomes]:
    """A rectangle, and something else in its plane before it or after it in the scene."""
    for kind in KINDS:
        for number, (chosen, place) in enumerate(
            itertools.chain(places(f"plane {kind}"), places(f"plane {kind} sizes", (1.0,), SCALES))
        ):
            pair = [rectangle(*_rectangle(place, 2.0)), _other(kind, place)][:: 1 - 2 * (number % 2)]
            targets, origins = _rays(place, chosen)
            ways = targets - origins
            plain = in_both(partial(_plainly, pair, origins, ways))
            found = (traced(pair, origins, ways).shape, *plain)
            yield Outcome(len(targets), *(tally(number != 0) for number in found))


def _rectangle(place: Place, half: float) -> tuple[Floats, Floats, Floats]:
    return place.at(-half, -half, 0), place.way(2 * half, 0, 0), place.way(half / 3, 2 * half, 0)


def _other(kind: str, place: Place) -> Json:
    if kind == "rectangle":
        return rectangle(*_rectangle(place, 1.5))
    if kind == "triangle":
        return triangle(*place.at(*(1.5 * CORNERS).T, 0))
    steps = np.linspace(-1.4, 1.4, 4 if kind == "small mesh" else 8)
    vertices, faces = grid(place, steps, 0.0)
    return mesh(vertices, faces)


def _rays(place: Place, chosen: np.random.Generator) -> tuple[Floats, Floats]:
    """Places (60, 3) well inside of both shapes, and origins above them."""
    across, along = (chosen.dirichlet([1, 1, 1], 60) @ CORNERS).T
    view, turn = 10 ** chosen.uniform(-2.5, 0, 60), chosen.uniform(0, 2 * np.pi, 60)
    targets = place.at(across, along, 0)
    return targets, targets + 3 * place.way(np.cos(turn), np.sin(turn), view)


def _plainly(pair: list[Json], origins: Floats, ways: Floats, dtype: type[np.floating]) -> Integers:
    """Number of the nearer of two shapes, the first of equal ones, for rays (N, 3)."""
    begins, along = origins.astype(dtype)[:, None], ways.astype(dtype)[:, None]
    nearest = []
    for shape in pair:
        formula, parts = pieces([shape])
        nearest.append(formula([part.astype(dtype) for part in parts], begins, along).min(axis=1))
    return np.argmin(np.stack(nearest), axis=0)


CASES: Cases = {
    "H1: rays in the plane of a box's side": in_the_plane_of_a_side,
    "H2: rays at the edges of boxes": at_the_edges,
    "H3: boxes that are flat, points, or all in one place": in_one_place,
    "H4: rays that are not finite": not_finite,
    "H10: faces that overlap in one plane": overlapping,
    "H5: faces in one place": equal_distances,
    "H11: shapes that overlap in one plane": overlapping_shapes,
}
