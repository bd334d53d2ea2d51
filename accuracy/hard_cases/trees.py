"""Hard cases: trees of boxes, which must find what asking every triangle finds."""

import itertools
from dataclasses import dataclass, replace

import numpy as np

import renderer
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, bulb, camera, phong, scene
from accuracy.hard_cases.slabs import (
    BoxTest,
    exact_sides_slabs,
    nearest,
    nearest_by_entries,
    nearest_in_met_boxes,
    plain_slabs,
)
from renderer.interaction import Rays
from renderer.math.arrays import Floats, Integers, Masks
from renderer.math.numerics import finite

SECTION = Section("Trees")

STEPS = 1024
"""Coordinates are multiples of 1 / STEPS below 4, so that differences of them are exact in float32 too."""


def mesh(corners: Floats, **changes: object) -> Json:
    """Triangles (T, 3, 3) as a mesh in which no vertex is shared."""
    numbers = np.arange(3 * len(corners)).reshape(-1, 3)
    return {
        "type": "mesh",
        "vertices": corners.reshape(-1, 3).tolist(),
        "triangles": numbers.tolist(),
        "material": "plain",
        **changes,
    }


def lattice(size: int) -> Floats:
    """Triangles (K, 3, 3) of an even net of axis-parallel edges, in three planes: every box is flat."""
    corners = []
    for i, j in itertools.product(range(size), repeat=2):
        a, b, c, d = ([i + x, j + y, 0] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
        corners += [[a, b, c], [a, c, d]]
    flat = np.array(corners, dtype=np.float64)
    return np.concatenate([np.roll(flat, axis, axis=2) for axis in range(3)])


def traced(shapes: list[Json], origins: Floats, directions: Floats) -> renderer.Hits:
    """What the renderer says of rays and shapes."""
    return renderer.trace(renderer.compile_scene(renderer.load_scene(scene(*shapes))), origins, directions)


def compared(corners: Floats, origins: Floats, directions: Floats, textbook: BoxTest | None) -> Outcome:
    """The renderer's tree, and one with a textbook's test of boxes, against asking every triangle."""
    t, first = nearest(corners, origins, directions)
    hits = traced([mesh(corners)], origins, directions)
    number = np.where(hits.shape < 0, -1, hits.primitive)
    plain = [
        np.count_nonzero(nearest_in_met_boxes(corners, origins, directions, textbook, dtype) != t)
        for dtype in (np.float64, np.float32)
        if textbook is not None
    ]
    return Outcome(len(t), int(np.count_nonzero((hits.t != t) | (number != first))), *(int(n) for n in plain))


@SECTION.case(
    "rays in the plane of a box's side",
    symptom="Lines of holes in meshes with axis-parallel faces, where the view is along an axis.",
    cause="0 times infinity is NaN, minimum and maximum hand it on, and the box counts as missed.",
    remedy="Boxes are widened by the rounding of what they hold: a ray that meets something in a box never "
    "lies in the plane of its side.",
    expected="Distance and number of the nearest triangle as of asking every one, bit for bit; +0 and -0 "
    "alike.",
    source="Ize 2013, Robust BVH ray traversal; Embree, pull request 589",
)
def in_the_plane_of_a_side() -> Outcome:
    """Whole and half numbers: in the planes of boxes, on edges, on vertices, and between."""
    rng = np.random.default_rng(2)
    origins = rng.integers(-4, 16, (2000, 3)) / 2
    directions = rng.choice([-1.0, 1.0, 0.5], (2000, 3))
    directions[rng.random((2000, 3)) < 0.6] = 0
    directions[~directions.any(axis=1)] = [0, 0, 1]
    negative = np.copysign(directions, np.where(directions, directions, rng.choice([-1.0, 1.0], (2000, 3))))
    corners = lattice(5)
    return total(compared(corners, origins, along, plain_slabs) for along in (directions, negative))


@SECTION.case(
    "rays at the edges of boxes",
    symptom="Single pixels that show what is behind a mesh, at its vertices and along its outline.",
    cause="Distances to the sides of a box are rounded, so a ray that touches it seems to leave before it "
    "enters.",
    remedy="The far side is moved out by 1 + 2 gamma(3), and boxes are widened by the rounding of what they "
    "hold.",
    expected="Distance and number of the nearest triangle as of asking every one, bit for bit.",
    source="Ize 2013, Robust BVH ray traversal; pbrt-v4, Bounds3::IntersectP",
)
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


BINS = 16


def plain_bins(places: Floats) -> Masks:
    """Whether each place (N, 3) gets a bin on the longest axis, as a textbook's builder sorts them."""
    low, high = places.min(axis=0), places.max(axis=0)
    axis = np.argmax(high - low)
    with np.errstate(invalid="ignore"):
        bins = BINS * (places[:, axis] - low[axis]) / (high[axis] - low[axis])
    return np.isfinite(bins)


@SECTION.case(
    "boxes that are flat, points, or all in one place",
    symptom="Building never ends, or the tree is one long chain and every ray slow.",
    cause="A builder that shares out places by where they are divides by the extent of their box: 0.",
    remedy="Triangles are shared out by number, half and half, whatever their places are.",
    expected="The first of 1,000 equal triangles is hit; flat meshes as of asking every triangle; triangles "
    "that are points are not hit.",
    source="Wald 2007, On fast construction of SAH-based bounding volume hierarchies",
)
def in_one_place() -> Outcome:
    """A thousand equal triangles, a flat mesh, and triangles that are points."""
    rng = np.random.default_rng(4)
    equal = np.broadcast_to([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], (1000, 3, 3))
    points = np.repeat(rng.integers(-8, 8, (300, 1, 3)) / 4, 3, axis=1)
    outcomes = []
    for corners in (equal, lattice(12)[:288], points):
        targets = corners[rng.integers(0, len(corners), 200)].mean(axis=1)
        origins = targets + rng.integers(-8, 9, (200, 3)) / 4 + [0, 0, 4]
        outcome = compared(corners, origins, targets - origins, None)
        unsorted = int(np.count_nonzero(~plain_bins(corners.mean(axis=1))))
        outcomes += [outcome, Outcome(len(corners), 0, unsorted, unsorted)]
    return total(outcomes)


@dataclass
class Watch:
    """Stage: counts the rays that come to the shapes and are not finite."""

    seen: int = 0

    def run(self, rays: Rays) -> None:
        """Look at a block of rays."""
        self.seen += int(np.count_nonzero(~(finite(rays.origins) & finite(rays.directions))))


@SECTION.case(
    "rays that are not finite",
    symptom="A picture takes minutes because of a few rays that are NaN.",
    cause="A test that drops NaN lets such a ray into every box of the tree.",
    remedy="Rays with a component that is not finite are taken out before anything is tested, and miss.",
    expected="Misses without visibility, none of which comes to a tree; the finite rays among them hit "
    "what they hit alone, bit for bit.",
    source="Embree, limits of its own tests",
)
def not_finite() -> Outcome:
    """NaN and both infinities in every component of origins and directions."""
    rng = np.random.default_rng(5)
    corners = rng.integers(-2 * STEPS, 2 * STEPS, (300, 3, 3)) / STEPS
    origins = rng.normal(size=(900, 3)) * 4
    directions = corners[rng.integers(0, 300, 900)].mean(axis=1) - origins
    bad, part = np.arange(900) % 3 == 0, rng.integers(0, 6, 900)
    rays = np.concatenate((origins, directions), axis=1)
    rays[bad, part[bad]] = rng.choice([np.nan, np.inf, -np.inf], np.count_nonzero(bad))
    shapes, light = [mesh(corners)], bulb([0.0, 9.0, 0.0])
    plan = renderer.compile_scene(renderer.load_scene(scene(*shapes, lights=[light])))
    watch = Watch()
    hits = renderer.trace(replace(plan, meetings=(watch, *plan.meetings)), rays[:, :3], rays[:, 3:])
    alone = renderer.trace(plan, rays[~bad, :3], rays[~bad, 3:])
    wrong = np.isfinite(hits.t[bad]) | (hits.shape[bad] >= 0) | hits.visibility[bad].any(axis=1)
    changed = (hits.t[~bad] != alone.t) | (hits.visibility[~bad] != alone.visibility).any(axis=1)
    everywhere = _in_every_box(corners, rays[bad])
    return Outcome(900, int(wrong.sum() + changed.sum()) + watch.seen, everywhere[0], everywhere[1])


def _in_every_box(corners: Floats, rays: Floats) -> tuple[int, int]:
    """Rays that the textbook's test lets into more than half of all boxes, in float64 and float32."""
    counts = [
        int(np.count_nonzero(np.mean([_met(t, rays, dtype) for t in corners], axis=0) > 0.5))
        for dtype in (np.float64, np.float32)
    ]
    return counts[0], counts[1]


def _met(triangle: Floats, rays: Floats, dtype: type[np.floating]) -> Masks:
    given = rays.astype(dtype)
    box = triangle.min(axis=0).astype(dtype), triangle.max(axis=0).astype(dtype)
    with np.errstate(all="ignore"):
        return exact_sides_slabs(box, given[:, :3], given[:, 3:])


@SECTION.case(
    "faces that overlap in one plane",
    symptom="Speckles of two colours where faces overlap, when they are seen from far away.",
    cause="Boxes behind a known hit are left out, and where a box begins is rounded: a face in it may be met "
    "before that.",
    remedy="A box is left out only where it begins farther than the hit by gamma(32).",
    expected="Distance and number of the nearest triangle as of asking every one, bit for bit.",
    source="geometry",
)
def overlapping() -> Outcome:
    """Triangles in one plane, from up to 200 and up to 12,000 units away."""
    rng = np.random.default_rng(7)
    corners = rng.integers(-2 * STEPS, 2 * STEPS, (60, 3, 3)) / STEPS
    corners[..., 2] = 0.5
    targets = np.concatenate((corners.mean(axis=1)[:, :2], np.full((60, 1), 0.5)), axis=1)
    outcomes = []
    for away in (64, 4096):
        origins = np.round(rng.normal(size=(1500, 3)) * away)
        directions = np.round(targets[rng.integers(0, 60, 1500)] * STEPS) / STEPS - origins
        outcome = compared(corners, origins, directions, None)
        t, _ = nearest(corners, origins, directions)
        plain = [
            int(np.count_nonzero(nearest_by_entries(corners, origins, directions, dtype) != t))
            for dtype in (np.float64, np.float32)
        ]
        outcomes += [outcome, Outcome(0, 0, *plain)]
    return total(outcomes)


@SECTION.case(
    "faces in one place",
    symptom="Speckles of two colours where faces coincide, different with every change of the tree or tile.",
    cause="Of hits at the same distance the first that was found is kept, and the order is the tree's.",
    remedy="Of equal hits the lowest shape counts, then the lowest triangle, in every comparison.",
    expected="The lowest number, however the triangles are shared out to meshes; pictures with a second mesh "
    "in the same place have the bytes of those without, at tiles of 5 pixels too.",
    source="geometry",
)
def equal_distances() -> Outcome:
    """Every triangle three times, once in the opposite order."""
    rng = np.random.default_rng(6)
    once = rng.integers(-2 * STEPS, 2 * STEPS, (80, 3, 3)) / STEPS
    thrice = np.concatenate((once, once[::-1], once))
    origins = rng.normal(size=(2000, 3)) * 4
    directions = once[rng.integers(0, 80, 2000)].mean(axis=1) - origins
    _, first = nearest(thrice, origins, directions)
    _, by_tree = nearest(thrice, origins, directions, order=_leaf_order(thrice))
    together = traced([mesh(thrice)], origins, directions).primitive
    apart = traced([mesh(thrice[i::2]) for i in (0, 1)], origins, directions)
    numbers = 2 * apart.primitive + apart.shape
    in_two = nearest(np.concatenate((thrice[::2], thrice[1::2])), origins, directions)[1]
    lowest = np.where(in_two < 120, 2 * in_two, 2 * (in_two - 120) + 1)
    wrong = np.count_nonzero(together != first) + np.count_nonzero(numbers != lowest)
    pixels = _two_colors(once)
    return Outcome(
        4000 + pixels.size, int(wrong + np.count_nonzero(pixels)), int(np.count_nonzero(by_tree != first))
    )


def _leaf_order(corners: Floats) -> Integers:
    """Numbers in the order of a textbook's walk: a stack, so that the last child comes first."""
    return np.argsort(corners.mean(axis=1)[:, 0], kind="stable")[::-1]


def _two_colors(corners: Floats) -> Masks:
    """Pixels that a second mesh in the same place changes."""
    materials = {"plain": phong(), "other": phong([0.1, 0.9, 0.2])}
    view = camera(position=[0.3, 1.0, 8.0], look_at=[0, 0, 0], width=40, height=30)
    images = []
    for shapes in ([mesh(corners)], [mesh(corners), mesh(corners[::-1], material="other")]):
        document = scene(*shapes, lights=[bulb([1.0, 7.0, 5.0])], materials=materials, camera=view)
        plan = renderer.compile_scene(renderer.load_scene(document))
        images.append(renderer.render(plan, tile_size=5 * len(shapes)).image)
    return (images[0] != images[1]).any(axis=2)
