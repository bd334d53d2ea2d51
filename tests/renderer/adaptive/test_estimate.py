"""The picture so far: samples that come in passes and tiles are kept as if they had come at once."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import camera, ellipsoid, scene, sphere, triangle
from renderer.adaptive import Estimate, Samples, render_samples
from renderer.adaptive.aims import FIRST_AIM, NEXT_AIM
from renderer.adaptive.decisions import advance
from renderer.adaptive.early_passes import PROBED
from renderer.adaptive.guides import surroundings
from renderer.adaptive.levels import COUNTS, COVERAGES, COVERED, PREVIEWED, SAMPLED
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.strata import expected_errors
from renderer.tiling import tiles
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile
from tests.pictures import pictures

TARGET = TargetQuality(mode="target", error=4 / 255)
SPACING = 2.0**-23
"""Spacing of float32 at 1."""


def plan_of(document: dict[str, Any] | None = None, **changes: Any) -> renderer.RenderPlan:
    document = pictures.of_room() if document is None else document
    return renderer.compile_scene({**document, **changes}, TARGET)


def begun(plan: renderer.RenderPlan) -> Estimate:
    return Estimate.begin(plan)


def large() -> renderer.RenderPlan:
    """The room in a picture that begins with pilot samples four pixels apart."""
    return plan_of(camera=camera(width=512, height=256))


def whole(estimate: Estimate) -> Tile:
    height, width = estimate.have.shape
    return Tile(0, 0, 0, width, height)


def found(estimate: Estimate, tile: Tile) -> Samples:
    """What the pass that is wanted finds in a tile."""
    around = surroundings(tile, estimate.values, estimate.labels, estimate.colors)
    return render_samples(estimate.plan, TileRequest(tile, estimate.requested.part(tile), around))


class Drawn:
    """Samples drawn beforehand, multiples of 1/256, and what passes find of them."""

    def __init__(self, height: int, width: int) -> None:
        random = np.random.default_rng(5)
        self.samples = random.integers(0, 256, (int(COUNTS[8]), 3, height, width)) / 256
        self.pilots = random.random((3, height, width)).astype(np.float32)
        self.covers, self.known = random.random((2, COVERAGES.size, 3, height, width)).astype(np.float32)
        self.spread, self.doubts = random.random((2, COVERAGES.size, height, width)).astype(np.float32)
        self.labels = random.integers(-3, 5, (height, width)).astype(np.int32)

    def samples_of(self, tile: Tile, levels: LevelRequest) -> Samples:
        inside = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        have, want = levels.have, levels.want
        previewed = (want == PREVIEWED) & (have < PREVIEWED)
        more = np.argwhere((want > COVERED) & (have < want))
        halves, squares = np.empty((2, 3, len(more)), np.float32), np.empty(len(more), np.float32)
        for number, (y, x) in enumerate(more):
            part = self.samples[COUNTS[have[y, x]] : COUNTS[want[y, x]], :, tile.y0 + y, tile.x0 + x]
            halves[:, :, number] = part[::2].mean(axis=0), part[1::2].mean(axis=0)
            squares[number] = ((part - part.mean(axis=0)) ** 2).sum() / 3
        pilots, labels = self.pilots[:, *inside][:, previewed], self.labels[inside][previewed]
        y, x = np.nonzero(levels.cover > levels.coverage)
        place = levels.cover[y, x], y + tile.y0, x + tile.x0
        covers, known = (each.transpose(0, 2, 3, 1)[place].T for each in (self.covers, self.known))
        spread, doubts = self.spread[place], self.doubts[place]
        seen = pilots, labels, pilots / 2, pilots[0] / 2
        found = halves, squares, squares > np.inf
        return Samples(*seen, covers, known, spread, doubts, *found, {}, {}, 0.0)


Passes = list[tuple[np.ndarray, np.ndarray]]


def taken(passes: Passes, size: int | None = None, order: int = 0) -> tuple[Estimate, Drawn]:
    """An estimate after passes that want these levels and coverages, in tiles of some size in some order."""
    plan = plan_of()
    estimate, drawn = begun(plan), Drawn(plan.height, plan.width)
    for number, (want, cover) in enumerate(passes):
        estimate.want[...], estimate.cover[...] = want, cover
        parts = tiles(plan, Pass(number, 1, 0, 0), size or 256)
        for place in np.random.default_rng(order).permutation(len(parts)):
            tile = parts[place]
            estimate.take(tile, drawn.samples_of(tile, estimate.requested.part(tile)))
    return estimate, drawn


def rising() -> Passes:
    """Levels of four passes, and coverages of a third of the pixels; each pixel skips some passes."""
    random = np.random.default_rng(1)
    levels = [random.choice([0, PREVIEWED, SAMPLED], (16, 24)).astype(np.uint8)]
    borders = random.random((16, 24)) < 1 / 3
    covers = [borders * random.choice([0, 2], (16, 24)).astype(np.uint8)]
    for _ in range(3):
        step = random.choice([0, 0, 1, 3], (16, 24))
        more = np.minimum(levels[-1] + step, 8)
        levels.append(np.where(more == COVERED, SAMPLED, more).astype(np.uint8))
        covers.append((covers[-1] + borders * random.choice([0, 1, 4], (16, 24))).astype(np.uint8))
    return list(zip(levels, covers, strict=True))


def test_several_passes_find_what_one_pass_with_all_their_samples_does() -> None:
    levels, covers = zip(*rising(), strict=True)
    estimate, drawn = taken(rising())
    covered = covers[-1] > 0
    reached = np.maximum.reduce(levels)
    assert (estimate.have == np.where(covered, np.maximum(reached, COVERED), reached)).all()
    assert len(np.unique(estimate.have)) > 6
    for y, x in np.argwhere(estimate.have >= SAMPLED):
        count = COUNTS[estimate.have[y, x]]
        samples = drawn.samples[:count, :, y, x]
        for half in (0, 1):
            mean = samples[half::2].mean(axis=0) + estimate.known[:, y, x]
            assert np.abs(estimate.halves[half, :, y, x] - mean).max() <= SPACING
        squares = ((samples - samples.mean(axis=0)) ** 2).sum() / 3
        # Means below 1, off by their rounding, are apart from each other by less than 1 in three merges.
        assert abs(estimate.squares[y, x] - squares) <= 3 * SPACING * count
    previewed = np.zeros_like(covered)
    have = np.zeros_like(levels[0])
    for level, cover in zip(levels, covers, strict=True):
        previewed |= (level == PREVIEWED) & (have < PREVIEWED)
        have = np.maximum(np.maximum(have, level), COVERED * (cover > 0))
    assert (previewed & covered).any()
    assert (estimate.values[:, previewed & ~covered] == drawn.pilots[:, previewed & ~covered]).all()
    assert len(np.unique(covers[-1])) > 6
    assert (estimate.coverage == covers[-1]).all()
    y, x = np.nonzero(covered)
    last = covers[-1][covered], y, x
    for name, drawn_name in (("values", "covers"), ("known", "known")):
        found, expected = getattr(estimate, name), getattr(drawn, drawn_name).transpose(0, 2, 3, 1)[last].T
        assert (found[:, covered] == expected).all()
    assert not estimate.known[:, ~covered].any()
    for name in ("spread", "doubts"):
        assert (getattr(estimate, name)[covered] == getattr(drawn, name)[last]).all()
    assert not estimate.spread[~covered].any()
    residues = np.where(previewed, drawn.pilots[0] / 2, 0)
    assert (estimate.doubts == residues)[~covered].all()
    shown = estimate.shown & (estimate.have >= SAMPLED)
    assert (estimate.image()[covered & ~shown] == estimate.values[:, covered & ~shown].T).all()
    assert (estimate.labels[previewed] == drawn.labels[previewed]).all()
    assert (estimate.colors[:, previewed] == drawn.pilots[:, previewed] / 2).all()
    assert (estimate.colors[:, ~previewed] == 1).all()


@pytest.mark.parametrize(("size", "order"), [(16, 1), (5, 2), (7, 3)])
def test_neither_tiles_nor_their_order_change_a_byte(size: int, order: int) -> None:
    once, several = taken(rising())[0].arrays(), taken(rising(), size, order)[0].arrays()
    assert once.keys() == several.keys()
    for name, array in once.items():
        assert array.tobytes() == several[name].tobytes(), name


def test_a_tile_that_comes_twice_counts_once() -> None:
    estimate, drawn = taken(rising())
    before = estimate.arrays()["halves"].tobytes()
    tile = whole(estimate)
    estimate.take(tile, drawn.samples_of(tile, estimate.requested))
    assert estimate.halves.tobytes() == before


def test_rendered_samples_of_two_passes_are_those_of_one() -> None:
    """The same rays and light points, so but for rounding to float32 between passes the same means."""
    plan = plan_of()
    tile = Tile(0, 4, 3, 17, 12)
    none, few, many = (np.full((9, 13), level, np.uint8) for level in (0, SAMPLED, SAMPLED + 3))
    first, more, both = (
        render_samples(plan, TileRequest(tile, LevelRequest(have, want, none, none)))
        for have, want in ((none, few), (few, many), (none, many))
    )
    merged = (first.halves * 4.0 + more.halves * 28.0) / 32
    assert np.abs(merged - both.halves).max() <= 2 * SPACING * both.halves.max()
    assert first.counts["camera"] + more.counts["camera"] == both.counts["camera"] == 32 * 9 * 13


def test_a_pixel_gets_the_same_samples_whatever_levels_the_others_rise_to() -> None:
    plan = plan_of()
    tile = Tile(0, 4, 3, 17, 12)
    have, want = np.random.default_rng(7).integers(SAMPLED, SAMPLED + 5, (2, 9, 13)).astype(np.uint8)
    none = np.zeros_like(have)
    mixed = render_samples(plan, TileRequest(tile, LevelRequest(have, want, none, none)))
    rising = want > have
    steps = set(zip(have[rising].tolist(), want[rising].tolist(), strict=True))
    assert len(steps) > 5
    for step in steps:
        alone = rising & (have == step[0]) & (want == step[1])
        some = np.where(alone, want, 0).astype(np.uint8)
        single = render_samples(plan, TileRequest(tile, LevelRequest(have, some, none, none)))
        assert mixed.halves[:, :, alone[rising]].tobytes() == single.halves.tobytes()
        assert mixed.squares[alone[rising]].tobytes() == single.squares.tobytes()


def edges_of(estimate: Estimate) -> np.ndarray:
    """Pixels that edges of flat shapes pass, (H, W) bool."""
    passed = np.zeros(estimate.have.shape, bool)
    passed[tuple(estimate.adaptive.edges[::-1])] = True
    return passed


def test_the_first_pass_samples_a_lattice_and_each_next_one_a_finer_one() -> None:
    """The last also at nodes of the others that were interpolated, where an edge passes."""
    estimate = begun(large())
    for stride in (4, 2, 1):
        assert estimate.stride == stride
        requested = estimate.want > estimate.have
        y, x = np.nonzero(requested)
        assert requested.any()
        assert (estimate.want[requested] == PREVIEWED).all()
        assert not (y % stride).any()
        assert not (x % stride).any()
        if stride < 4:
            fresh = (y % (2 * stride) > 0) | (x % (2 * stride) > 0)
            assert (fresh if stride > 1 else fresh | edges_of(estimate)[requested]).all()
        passes(estimate, 1)
    assert (estimate.have[edges_of(estimate)] == PREVIEWED).all()
    assert (estimate.have == 0).any()
    assert (estimate.values[:, estimate.have == PREVIEWED] > 0).any()


def test_after_the_pilot_samples_come_the_borders_and_then_the_probes() -> None:
    """Borders lie where a neighbour shows another shape, around the picture, where an edge passes, and around
    what is thin. Where things of other shapes are as bright, there is no need of rays.
    """
    thorn = triangle([-2, 0.5, 0], [-2, 0.9, 0], [1.4, 1.3, 0])
    wire = ellipsoid([0, 2.2, 0], [1.2, 0, 0], [0, 0.01, 0], [0, 0, 0.01])
    fine = TargetQuality(mode="target", error=2.0**-10)
    estimate = begun(renderer.compile_scene(scene(thorn, wire, sphere([0, -0.5, 0], 0.7)), fine))
    passes(estimate, 1)
    borders = estimate.cover > 0
    assert not estimate.want.any()
    assert not estimate.coverage.any()
    edges, near, unlike = edges_of(estimate), np.zeros_like(borders), np.zeros_like(borders)
    for x, y in estimate.adaptive.thin.T:
        near[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = True
    labels = np.pad(estimate.labels, 1, constant_values=-99)
    for y, x in np.ndindex(unlike.shape):
        unlike[y, x] = (labels[y : y + 3, x : x + 3] != estimate.labels[y, x]).any()
    rim = np.pad(np.zeros((borders.shape[0] - 2, borders.shape[1] - 2), bool), 1, constant_values=True)
    assert borders[edges | near | rim].all()
    seen = unlike & ~(edges | near | rim)
    assert not borders[~(edges | near | unlike)].any()
    assert (borders & seen).any()
    bare = seen & ~borders
    assert estimate.contrasts[bare].max(initial=0) < estimate.contrasts[borders & seen].min()
    assert (edges & ~near & ~unlike).any()
    assert (near & ~edges & ~unlike).any()
    assert not borders.all()
    passes(estimate, 1)
    assert (estimate.have[borders] == COVERED).all()
    assert (estimate.coverage == estimate.cover).all()
    requested = estimate.want > estimate.have
    assert requested.any()
    assert (estimate.want[requested] == PROBED).all()
    assert estimate.error is None


def test_each_node_of_the_lattice_fills_its_square_until_finer_ones_come() -> None:
    estimate = begun(large())
    tile = whole(estimate)
    estimate.take(tile, found(estimate, tile))
    coarse = estimate.image()
    nodes = estimate.values[:, ::4, ::4].transpose(1, 2, 0)
    assert (coarse == nodes.repeat(4, axis=0).repeat(4, axis=1)).all()
    advance(estimate)
    assert (estimate.image()[::4, ::4] == coarse[::4, ::4]).all()
    # What is interpolated is there at once; what comes shows the node that it lies beside.
    coming = (estimate.want == PREVIEWED) & (estimate.have == 0)
    assert (estimate.image()[coming] == coarse[coming]).all()
    half = Tile(0, 0, 0, 512, 101)
    part = np.s_[half.y0 : half.y1, half.x0 : half.x1]
    estimate.take(half, found(estimate, half))
    image = estimate.image()
    known = np.zeros_like(coming)
    known[part] = coming[part]
    assert known.any()
    assert (coming & ~known).any()
    assert (image[known] == estimate.values[:, known].T).all()
    assert (image[coming & ~known] == coarse[coming & ~known]).all()
    pixels = estimate.part(Tile(3, 5, 92, 199, 113))
    assert (pixels.shape, pixels.dtype) == ((21, 194, 3), np.float32)
    assert pixels.tobytes() == np.ascontiguousarray(image[92:113, 5:199]).tobytes()


def passes(estimate: Estimate, count: int) -> None:
    tile = whole(estimate)
    for _ in range(count):
        estimate.take(tile, found(estimate, tile))
        if not advance(estimate):
            return


@pytest.mark.parametrize("before", [0, 1, 2, 3])
def test_an_estimate_that_is_stored_and_loaded_continues_with_the_same_bytes(before: int) -> None:
    plan = plan_of()
    estimate = begun(plan)
    passes(estimate, before)
    put_away = {name: array.copy() for name, array in estimate.arrays().items()}
    assert ("error" in put_away) == (estimate.error is not None)
    again = Estimate.restored(plan, put_away)
    assert again.error == estimate.error
    assert again.image().tobytes() == estimate.image().tobytes()
    for each in (estimate, again):
        passes(each, 2)
    one, other = estimate.arrays(), again.arrays()
    assert one.keys() == other.keys()
    for name, array in one.items():
        assert (array.dtype, array.shape) == (other[name].dtype, other[name].shape)
        assert array.tobytes() == other[name].tobytes(), name


def test_before_there_are_samples_the_error_is_what_the_coarse_picture_lets_expect() -> None:
    plan = plan_of()
    estimate = begun(plan)
    passes(estimate, 1)
    settled = estimate.settle()
    expected = np.sqrt(expected_errors(estimate.image().transpose(2, 0, 1)).mean(dtype=float))
    assert settled.estimate == pytest.approx(expected, rel=1e-12)
    assert settled.low <= settled.estimate <= settled.high <= settled.bound


def test_in_the_middle_of_a_pass_pixels_that_wait_for_samples_err_like_their_pilot_samples() -> None:
    """Pilot samples are 1/4. By halves of 3/4 and 1/2 they err by 1/8, and their mean by 1/64; by half as
    many probes they do not err.
    """
    estimate = begun(plan_of())
    estimate.values[...], estimate.have[...] = 1 / 4, PREVIEWED
    estimate.shown[:10] = True
    estimate.have[6:12], estimate.halves[:, :, 10:12] = SAMPLED, 1 / 4
    estimate.halves[:, :, 6:10] = [[[[3 / 4]]] * 3, [[[1 / 2]]] * 3]
    total = 4 * 24 / 64 + 12 * 24 / 8 * 4 / 6  # rows 6 to 9 show samples; 10 and 11 are probes
    assert estimate.settle().estimate == pytest.approx(np.sqrt(total / (16 * 24)), rel=1e-12)
    assert (estimate.image()[:6] == 1 / 4).all()
    estimate.have[:6], estimate.halves[:, :, :6] = SAMPLED, estimate.halves[:, :, 6:7]
    total = 10 * 24 / 64
    assert estimate.settle().estimate == pytest.approx(np.sqrt(total / (16 * 24)), rel=1e-12)


def test_where_time_is_limited_coarser_errors_are_worked_for_first() -> None:
    """Each is left behind when the error is surely smaller."""
    hurried = TargetQuality(mode="target", error=2.0**-10, time_limit=1000)
    estimate = begun(renderer.compile_scene(pictures.of_room(), hurried))
    tile, aims, more = whole(estimate), [estimate.aim], True
    while more:
        estimate.take(tile, found(estimate, tile))
        more = advance(estimate)
        aims.append(estimate.aim)
        if estimate.error is not None and more:
            reached = [aim for aim in aims if estimate.error.bound <= aim]
            assert estimate.aim not in reached
            assert estimate.budget == estimate.aim**2 * 16 * 24
    assert sorted(set(aims), reverse=True) == [FIRST_AIM * NEXT_AIM**number for number in range(3)]
    assert aims == sorted(aims, reverse=True)
    assert estimate.error is not None
    assert estimate.error.bound <= 2.0**-10


@pytest.mark.parametrize(
    ("error", "limit", "aim"),
    [(2.0**-12, None, 2.0**-12), (2.0**-12, 9.0, FIRST_AIM), (2 * FIRST_AIM, 9.0, 2 * FIRST_AIM)],
)
def test_the_first_aim_is_coarse_only_where_time_is_limited(
    error: float, limit: float | None, aim: float
) -> None:
    quality = TargetQuality(mode="target", error=error, time_limit=limit)
    assert begun(renderer.compile_scene(pictures.of_room(), quality)).aim == aim


def test_a_lens_samples_a_lattice_that_is_coarser_than_that_of_pilot_samples() -> None:
    view = pictures.of_room()["camera"]
    stride = begun(plan_of(camera=view)).stride
    estimate = begun(plan_of(camera=view | {"lens_radius": 0.1}))
    assert estimate.stride == 2 * stride
    nodes = np.zeros(estimate.have.shape, dtype=bool)
    nodes[:: 2 * stride, :: 2 * stride] = True
    assert np.array_equal(estimate.want >= SAMPLED, nodes)
    assert np.array_equal(estimate.shown, nodes)
