"""Hard cases J: pictures that must not depend on units, places, directions, tiles or precision."""

from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from functools import cache, partial

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, triangle
from accuracy.hard_cases.harness import (
    DOUBLE,
    SINGLE,
    Outcome,
    Section,
    in_both,
    plain_only,
    tally,
    total,
    traced,
)
from accuracy.hard_cases.scene_values.scenes import (
    QUARTER,
    SCENES,
    ball_on_a_floor,
    image_of,
    on_edges,
    placed,
    plain_picture,
    plan_of,
    turn,
)
from renderer.integrator import camera_rays, radiance
from renderer.math.arrays import Floats, Masks, Pairs
from renderer.tiling import blocks, tiles
from schemas.quality import FixedQuality
from schemas.tiles import Pass

SECTION = Section("Units, places and tiles")

CODE = 1 / 255
"""One step of a picture of 8 bits: pixels that differ by less look the same."""

Change = Callable[[Json], Json]

EDGE = (
    "An edge is a pixel whose rays through its corners, sides and centre do not all hit the same shapes and "
    "see the same share of every light, in mirrors and through glass too."
)


def wrong_pixels(image: Pairs, expected: Pairs, edges: Masks, share: float) -> int:
    """Pixels that look different off all edges, and those on edges beyond a share of the picture."""
    changed = ~(np.abs(image - expected).reshape(*edges.shape, -1).max(axis=2) <= CODE)
    on_edge, off_edge = (tally(changed & where) for where in (edges, ~edges))
    return off_edge + max(0, on_edge - int(share * edges.size))


def unlike(image: Pairs, expected: Pairs) -> int:
    """Pixels with other bytes."""
    return tally((image != expected).any(axis=2) | ~np.isfinite(image).all(axis=2))


@cache
def edges_of(make: Callable[[], Json]) -> Masks:
    """Pixels (H, W) on edges of a scene; several cases ask for them."""
    return on_edges(plan_of(make()))


def alike(changes: list[Change], share: float = 0.001, quality: FixedQuality = SINGLE) -> Outcome:
    """Whether scenes look the same after each change, but for a share of pixels, which are edges.

    Double precision draws the same but for its own edges, which another case counts.
    """
    outcomes = []
    for make in SCENES.values():
        document = make()
        edges, expected = edges_of(make), image_of(document, quality)
        wrong = [
            wrong_pixels(image_of(change(document), quality), expected, edges, share) for change in changes
        ]
        outcomes.append(Outcome(edges.size * len(changes), sum(wrong)))
    return total([*outcomes, _plainly(changes, share)])


def _plainly(changes: list[Change], share: float) -> Outcome:
    """The textbook's picture before and after the same changes, by the same measure."""
    document, edges = ball_on_a_floor(), edges_of(ball_on_a_floor)

    def wrong(dtype: type[np.floating]) -> int:
        expected = plain_picture(document, dtype)
        images = (plain_picture(change(document), dtype) for change in changes)
        return sum(wrong_pixels(image, expected, edges, share) for image in images)

    return plain_only(*in_both(wrong))


@SECTION.case(
    "J6: a scene in units of another power of two",
    symptom="Shadows vanish in small models; large ones are covered with dark speckles.",
    cause="A least distance, such as t > 0.0001, is a length: as large as one scene, and nothing in another.",
    remedy="No bound is a length; each is a multiple of the numbers that it is about. What is rounded to "
    "float32 is counted in a unit of about its own size.",
    expected="The same bytes at 2^-300, 2^-20 and 2^40 times the size, in both precisions.",
    source="geometry (such a scale is exact)",
)
def powers_of_two() -> Outcome:
    """Every scene, in both precisions."""
    changes: list[Change] = [partial(placed, scale=2.0**power) for power in (-300, -20, 40)]
    outcomes = [_plainly(changes, 0.0)]
    for make in SCENES.values():
        document = make()
        for quality in (SINGLE, DOUBLE):
            expected = image_of(document, quality)
            wrong = sum(unlike(image_of(change(document), quality), expected) for change in changes)
            outcomes.append(Outcome(len(changes) * expected[..., 0].size, wrong))
    return total(outcomes)


@SECTION.case(
    "J6: a scene in other units",
    symptom="The picture of a model in millimetres is not that of the same model in kilometres.",
    cause="The same lengths, and the rounding of every number that is written anew.",
    remedy="No bound is a length; each is a multiple of the numbers that it is about.",
    expected="At 1e-6 and 1e6 times the size at most 0.1 % of the pixels differ by more than 1/255, and "
    "those are edges. " + EDGE,
)
def other_units() -> Outcome:
    """A million times smaller and larger."""
    return alike([lambda document: placed(document, 1e-6), lambda document: placed(document, 1e6)])


@SECTION.case(
    "J7: a scene far from the origin",
    symptom="Far from the origin all columns of a picture are one, or everything is covered with speckles.",
    cause="Places are rounded to a coarse grid there, and points of a virtual screen fall together.",
    remedy="Places are float64, directions are formed apart from the camera's place, and differences of "
    "places come first in every formula.",
    expected="Moved by 2^20 and by 1e6 at most 0.1 % of the pixels differ by more than 1/255, and those are "
    "edges, as above.",
)
def far_away() -> Outcome:
    """A million units along every axis."""
    return alike([lambda document: placed(document, offset=2.0**20), lambda d: placed(d, offset=1e6)])


@SECTION.case(
    "J8: a scene and its camera turned together",
    symptom="Walls that are not parallel to an axis show seams or speckles.",
    cause="Corners that were whole numbers are rounded after a turn, in float32 to a coarse grid.",
    remedy="No formula knows an axis of the world; places are float64.",
    expected="A quarter turn leaves the bytes in double precision, and each value to 2^-20 in single, where "
    "sums are rounded in another order. A turn by 37 degrees changes no pixel by more than 1/255 but edges.",
    source="geometry (a quarter turn is exact)",
)
def turned() -> Outcome:
    """A quarter turn about one axis for each scene, in turn, and 37 degrees about none of them."""
    outcomes = [alike([lambda document: placed(document, turned=turn(37))], share=1.0)]
    for number, make in enumerate(SCENES.values()):
        document = make()
        other = quarters(document)[number % 3]
        image, expected = (image_of(each, DOUBLE) for each in (other, document))
        off = np.abs(image_of(other) - image_of(document)).max(axis=2) > 2.0**-20
        outcomes.append(Outcome(2 * off.size, unlike(image, expected) + tally(off)))
    return total([*outcomes, _plain_quarters()])


def quarters(document: Json) -> list[Json]:
    """A scene after a quarter turn about z, x and y."""
    return [placed(document, turned=np.roll(QUARTER, shift, axis=(0, 1))) for shift in range(3)]


def _plain_quarters() -> Outcome:
    """The textbook's pictures after quarter turns, as a file would hold them."""

    def wrong(dtype: type[np.floating]) -> int:
        expected, *images = (
            plain_picture(each, dtype).astype(np.float32)
            for each in (ball_on_a_floor(), *quarters(ball_on_a_floor()))
        )
        return sum(tally(image != expected) for image in images)

    return plain_only(*in_both(wrong))


@SECTION.case(
    "J9: tiles of any size",
    symptom="Faint lines along the borders of tiles, or a picture that changes with the number of workers.",
    cause="A matrix product of the linear algebra library adds in another order when it has fewer rows.",
    remedy="Products of vectors are written out by components, so that a pixel's arithmetic is its own.",
    expected="The same bytes of every sample's radiance in float64 for tiles of 1, 7 and 64 pixels, "
    "and of the picture.",
    source="OpenBLAS, whose kernels differ by shape",
)
def tiles_of_any_size() -> Outcome:
    """Small pictures of every scene."""
    tried = wrong = 0
    for make in SCENES.values():
        document = {**make(), "camera": {**make()["camera"], "width": 8, "height": 6}}
        plan = plan_of(document, DOUBLE)
        whole, picture = radiances(plan, 64), renderer.render(plan, tile_size=64).image
        differ = [(radiances(plan, size) != whole).any(axis=(2, 3)) for size in (1, 7)]
        differ.append((renderer.render(plan, tile_size=7).image != picture).any(axis=2))
        tried, wrong = tried + 3 * 48, wrong + tally(differ)
    return Outcome(tried, wrong)


def radiances(plan: renderer.RenderPlan, side: int) -> Floats:
    """Radiance of every camera sample (H, W, S, 3), tile by tile, before anything is rounded to float32."""
    count = plan.antialiasing.samples
    every = Pass(index=1, stride=1, first=0, last=count)
    result = np.full((plan.height, plan.width, count, 3), np.nan)
    for tile in tiles(plan, every, side):
        for block in blocks(tile, every):
            values = radiance(plan, camera_rays(plan, block, every), Counter())
            result[block.rows, block.columns] = values.reshape(3, -1, count).transpose(1, 2, 0)
    return result


@SECTION.case(
    "J10: single against double precision",
    symptom="The faster precision shows speckles, or shadows with ragged edges.",
    cause="In float32 a place a million units away is off by up to a thirtieth of a unit.",
    remedy="Single precision rounds only differences that were formed in float64: pairs of point and light.",
    expected="Near the origin and a million units away at most 0.5 % of the pixels differ by over 1/255, "
    "and those are edges, as above; no pixel is NaN or infinite.",
)
def both_precisions() -> Outcome:
    """Every scene, also far from the origin."""
    outcomes = []
    for make in SCENES.values():
        for offset in (0.0, 1e6):
            document = placed(make(), offset=offset)
            single, double = (image_of(document, quality) for quality in (SINGLE, DOUBLE))
            wrong = wrong_pixels(single, double, on_edges(plan_of(document)), 0.005)
            bad = tally(~(np.isfinite(single) & np.isfinite(double)).all(axis=2))
            outcomes.append(Outcome(single[..., 0].size, wrong + bad))
    return total([*outcomes, _plain_precisions()])


def _plain_precisions() -> Outcome:
    wrong = 0
    for offset in (0.0, 1e6):
        document = placed(ball_on_a_floor(), offset=offset)
        double, single = in_both(partial(plain_picture, document))
        wrong += wrong_pixels(single, double, on_edges(plan_of(document)), 0.005)
    return plain_only(None, wrong)


PAIRS, RAYS = 60, 20


def fused(a: float, b: float, c: float) -> float:
    """Product and sum a * b + c with one rounding, as a fused multiply-add gives them."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def fused_edge(p: Floats, q: Floats) -> float:
    """The product p x q as compilers may write it: one product is rounded, the other is not."""
    return fused(float(p[0]), float(q[1]), -float(p[1] * q[0]))


def is_hit(triangle_: Floats, origin: Floats, direction: Floats) -> bool:
    """Woop's test of a triangle (3, 3), with fused edge functions."""
    axis = int(np.argmax(np.abs(direction)))
    others = [(axis + 1) % 3, (axis + 2) % 3]
    relative = triangle_ - origin
    sheared = relative[:, others] - relative[:, axis, None] * (direction[others] / direction[axis])
    a, b, c = sheared
    weights = [fused_edge(c, b), fused_edge(a, c), fused_edge(b, a)]
    return min(weights) >= 0 or max(weights) <= 0


@SECTION.case(
    "J11: fused products in edge functions",
    symptom="Dots of background along the edges of a mesh, on some machines only.",
    cause="A fused multiply-add rounds one of two products, so p x q is no longer -(q x p): two neighbours "
    "both take a ray on their common edge for outside.",
    remedy="Every product and difference is a NumPy call of its own, which rounds once: nothing is fused.",
    expected="Every ray at the common edge of two triangles hits one of them.",
    source="Woop, Benthin, Wald 2013, Watertight ray/triangle intersection",
)
def fused_products() -> Outcome:
    """Rays at places on the common edge of two triangles."""
    rng = np.random.default_rng(1)
    wrong = plain = 0
    for _ in range(PAIRS):
        a, b, c = rng.normal(size=(3, 3))
        across = b + c - a + 0.1 * rng.normal(size=3)
        normal = np.cross(b - a, c - a)
        targets = b + np.outer(rng.uniform(0.05, 0.95, RAYS), c - b)
        origins = targets + 3 * normal / np.linalg.norm(normal) + rng.normal(size=(RAYS, 3)) * 0.2
        directions = targets - origins
        pair = np.array([[a, b, c], [across, c, b]])
        wrong += tally(traced([triangle(*corners) for corners in pair], origins, directions).shape < 0)
        plain += sum(
            not any(is_hit(corners, *ray) for corners in pair)
            for ray in zip(origins, directions, strict=True)
        )
    return Outcome(PAIRS * RAYS, wrong, plain)
