"""Hard cases J: pictures that must not depend on units, places, directions, tiles or precision."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache, partial

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json
from accuracy.hard_cases.flat_shapes import pairs_of_triangles
from accuracy.hard_cases.harness import (
    DOUBLE,
    SINGLE,
    Cases,
    Outcome,
    Outcomes,
    in_both,
    plain_only,
    tally,
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

CODE = 1 / 255
"""One step of a picture of 8 bits: pixels that differ by less look the same."""

Change = Callable[[Json], Json]


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


def alike(changes: list[Change], share: float = 0.001, quality: FixedQuality = SINGLE) -> Iterator[Outcomes]:
    """Whether scenes look the same after each change, but for a share of pixels, which are edges.

    Double precision draws the same but for its own edges, which another case counts.
    """
    for make in SCENES.values():
        document = make()
        edges, expected = edges_of(make), image_of(document, quality)
        wrong = [
            wrong_pixels(image_of(change(document), quality), expected, edges, share) for change in changes
        ]
        yield Outcome(edges.size * len(changes), sum(wrong))
    yield _plainly(changes, share)


def _plainly(changes: list[Change], share: float) -> Outcome:
    """The textbook's picture before and after the same changes, by the same measure."""
    document, edges = ball_on_a_floor(), edges_of(ball_on_a_floor)

    def wrong(dtype: type[np.floating]) -> int:
        expected = plain_picture(document, dtype)
        images = (plain_picture(change(document), dtype) for change in changes)
        return sum(wrong_pixels(image, expected, edges, share) for image in images)

    return plain_only(*in_both(wrong))


def powers_of_two() -> Iterator[Outcomes]:
    """Every scene, in both precisions."""
    changes: list[Change] = [partial(placed, scale=2.0**power) for power in (-300, -20, 40)]
    yield _plainly(changes, 0.0)
    for make in SCENES.values():
        document = make()
        for quality in (SINGLE, DOUBLE):
            expected = image_of(document, quality)
            wrong = sum(unlike(image_of(change(document), quality), expected) for change in changes)
            yield Outcome(len(changes) * expected[..., 0].size, wrong)


def turned() -> Iterator[Outcomes]:
    """A quarter turn about one axis for each scene, in turn, and 37 degrees about none of them."""
    yield alike([lambda document: placed(document, turned=turn(37))], share=1.0)
    for number, make in enumerate(SCENES.values()):
        document = make()
        other = quarters(document)[number % 3]
        image, expected = (image_of(each, DOUBLE) for each in (other, document))
        off = np.abs(image_of(other) - image_of(document)).max(axis=2) > 2.0**-20
        yield Outcome(2 * off.size, unlike(image, expected) + tally(off))
    yield _plain_quarters()


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


def both_precisions() -> Iterator[Outcomes]:
    """Every scene, also far from the origin."""
    for make in SCENES.values():
        for offset in (0.0, 1e6):
            document = placed(make(), offset=offset)
            single, double = (image_of(document, quality) for quality in (SINGLE, DOUBLE))
            wrong = wrong_pixels(single, double, on_edges(plan_of(document)), 0.005)
            bad = tally(~(np.isfinite(single) & np.isfinite(double)).all(axis=2))
            yield Outcome(single[..., 0].size, wrong + bad)
    yield _plain_precisions()


def _plain_precisions() -> Outcome:
    wrong = 0
    for offset in (0.0, 1e6):
        document = placed(ball_on_a_floor(), offset=offset)
        double, single = in_both(partial(plain_picture, document))
        wrong += wrong_pixels(single, double, on_edges(plan_of(document)), 0.005)
    return plain_only(None, wrong)


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


def fused_products() -> Iterator[Outcomes]:
    """Rays at places on the common edge of two triangles."""
    for pair in itertools.islice(pairs_of_triangles(), 60):
        hits = traced(pair.shapes, pair.origins, pair.directions)
        rays = zip(pair.origins, pair.directions, strict=True)
        lost = sum(not any(is_hit(corners, *ray) for corners in pair.parts) for ray in rays)
        yield Outcome(len(hits.t), tally(hits.shape < 0), lost)


CASES: Cases = {
    "J6: a scene in units of another power of two": powers_of_two,
    "J6: a scene in other units": lambda: alike(
        [lambda document: placed(document, 1e-6), lambda document: placed(document, 1e6)]
    ),
    "J7: a scene far from the origin": lambda: alike(
        [lambda document: placed(document, offset=2.0**20), lambda d: placed(d, offset=1e6)]
    ),
    "J8: a scene and its camera turned together": turned,
    "J9: tiles of any size": tiles_of_any_size,
    "J10: single against double precision": both_precisions,
    "J11: fused products in edge functions": fused_products,
}
