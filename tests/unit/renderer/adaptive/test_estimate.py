"""The picture so far: samples that come in passes and tiles are kept as if they had come at once."""

from typing import Any

import numpy as np
import pytest

import renderer
from renderer.adaptive import Estimate, Samples, render_samples
from renderer.adaptive.estimate import PROBED, STRIDE
from renderer.adaptive.levels import COUNTS, LOOKED, SAMPLED
from renderer.adaptive.strata import expected_errors
from renderer.tiling import tiles
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile
from tests.images import pictures

TARGET = TargetQuality(mode="target", error=4 / 255)
ROUND = 2.0**-23
"""Spacing of float32 at 1."""


def plan_of(document: dict[str, Any] | None = None, **changes: Any) -> renderer.RenderPlan:
    document = pictures.of_room() if document is None else document
    return renderer.compile_scene({**document, **changes}, TARGET)


def begun(plan: renderer.RenderPlan) -> Estimate:
    return Estimate.begin(plan)


def whole(estimate: Estimate) -> Tile:
    height, width = estimate.have.shape
    return Tile(0, 0, 0, width, height)


class Drawn:
    """Samples drawn beforehand, multiples of 1/256, and what passes tell of them."""

    def __init__(self, height: int, width: int) -> None:
        random = np.random.default_rng(5)
        self.samples = random.integers(0, 256, (int(COUNTS[7]), 3, height, width)) / 256
        self.looks = random.random((3, height, width)).astype(np.float32)
        self.labels = random.integers(-3, 5, (height, width)).astype(np.int32)

    def told(self, tile: Tile, have: np.ndarray, want: np.ndarray) -> Samples:
        inside = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        looked = (want == LOOKED) & (have < LOOKED)
        more = np.argwhere((want > LOOKED) & (have < want))
        halves, squares = np.empty((2, 3, len(more)), np.float32), np.empty(len(more), np.float32)
        for number, (y, x) in enumerate(more):
            part = self.samples[COUNTS[have[y, x]] : COUNTS[want[y, x]], :, tile.y0 + y, tile.x0 + x]
            halves[:, :, number] = part[::2].mean(axis=0), part[1::2].mean(axis=0)
            squares[number] = ((part - part.mean(axis=0)) ** 2).sum() / 3
        looks = self.looks[:, *inside][:, looked]
        return Samples(looks, self.labels[inside][looked], looks / 2, halves, squares, {}, {}, 0.0)


def taken(levels: list[np.ndarray], size: int | None = None, order: int = 0) -> tuple[Estimate, Drawn]:
    """An estimate after passes that want these levels (H, W), in tiles of some size in some order."""
    plan = plan_of()
    estimate, drawn = begun(plan), Drawn(plan.height, plan.width)
    for number, want in enumerate(levels):
        estimate.want[...] = want
        parts = tiles(plan, Pass(number, 1, 0, 0), size or 256)
        for place in np.random.default_rng(order).permutation(len(parts)):
            tile = parts[place]
            part = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
            have = estimate.have[part].copy()
            estimate.take(tile, drawn.told(tile, have, estimate.want[part]))
    return estimate, drawn


def rising() -> list[np.ndarray]:
    """Levels of four passes; each pixel skips some of them."""
    random = np.random.default_rng(1)
    levels = [random.choice([0, 1, 2], (16, 24)).astype(np.uint8)]
    for _ in range(3):
        levels.append(np.minimum(levels[-1] + random.choice([0, 0, 1, 3], (16, 24)), 7).astype(np.uint8))
    return levels


def test_several_passes_tell_what_one_pass_with_all_their_samples_does() -> None:
    levels = rising()
    estimate, drawn = taken(levels)
    assert (estimate.have == np.maximum.reduce(levels)).all()
    assert len(np.unique(estimate.have)) > 5
    for y, x in np.argwhere(estimate.have >= SAMPLED):
        count = COUNTS[estimate.have[y, x]]
        samples = drawn.samples[:count, :, y, x]
        for half in (0, 1):
            mean = samples[half::2].mean(axis=0)
            assert np.abs(estimate.halves[half, :, y, x] - mean).max() <= ROUND
        squares = ((samples - samples.mean(axis=0)) ** 2).sum() / 3
        # Means below 1, off by their rounding, are apart from each other by less than 1 in three merges.
        assert abs(estimate.squares[y, x] - squares) <= 3 * ROUND * count
    looked = np.logical_or.reduce([level == LOOKED for level in levels])
    assert (estimate.values[:, looked] == drawn.looks[:, looked]).all()
    assert (estimate.labels[looked] == drawn.labels[looked]).all()
    assert (estimate.colors[:, looked] == drawn.looks[:, looked] / 2).all()
    assert (estimate.colors[:, ~looked] == 1).all()


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
    estimate.take(tile, drawn.told(tile, estimate.have, estimate.want))
    assert estimate.halves.tobytes() == before


def test_rendered_samples_of_two_passes_are_those_of_one() -> None:
    """The same rays and light points, so but for rounding to float32 between passes the same means."""
    plan = plan_of()
    tile = Tile(0, 4, 3, 17, 12)
    none, few, many = (np.full((9, 13), level, np.uint8) for level in (0, 2, 5))
    first, more = render_samples(plan, tile, none, few), render_samples(plan, tile, few, many)
    both = render_samples(plan, tile, none, many)
    merged = (first.halves * 4.0 + more.halves * 28.0) / 32
    assert np.abs(merged - both.halves).max() <= 2 * ROUND * both.halves.max()
    assert first.counts["camera"] + more.counts["camera"] == both.counts["camera"] == 32 * 9 * 13


def test_the_first_pass_looks_at_a_lattice_and_each_next_one_at_a_finer_one() -> None:
    plan = plan_of()
    estimate = begun(plan)
    tile = whole(estimate)
    for stride in (8, 4, 2, 1):
        assert estimate.counters[STRIDE] == stride
        asked = estimate.want > estimate.have
        y, x = np.nonzero(asked)
        assert asked.any()
        assert not (y % stride).any()
        assert not (x % stride).any()
        if stride < 8:
            assert ((y % (2 * stride) > 0) | (x % (2 * stride) > 0)).all()
        estimate.take(tile, render_samples(plan, tile, estimate.have, estimate.want))
        assert estimate.advance()
    assert (estimate.values[:, estimate.have == LOOKED] > 0).any()
    probes = estimate.want > estimate.have
    assert probes.any()
    assert (estimate.want[probes] == PROBED).all()
    assert estimate.error is None


def test_each_node_of_the_lattice_fills_its_square_until_finer_ones_come() -> None:
    plan = plan_of()
    estimate = begun(plan)
    tile = whole(estimate)
    estimate.take(tile, render_samples(plan, tile, estimate.have, estimate.want))
    coarse = estimate.image()
    nodes = estimate.values[:, ::8, ::8].transpose(1, 2, 0)
    assert (coarse == nodes.repeat(8, axis=0).repeat(8, axis=1)[:16, :24]).all()
    estimate.advance()
    assert (estimate.image()[::8, ::8] == coarse[::8, ::8]).all()
    # What is interpolated is there at once; what comes shows the node that it lies beside.
    coming = (estimate.want == LOOKED) & (estimate.have == 0)
    assert (estimate.image()[coming] == coarse[coming]).all()
    half = Tile(0, 0, 0, 24, 7)
    part = np.s_[half.y0 : half.y1, half.x0 : half.x1]
    estimate.take(half, render_samples(plan, half, estimate.have[part], estimate.want[part]))
    image = estimate.image()
    known = np.zeros_like(coming)
    known[part] = coming[part]
    assert (image[known] == estimate.values[:, known].T).all()
    assert (image[coming & ~known] == coarse[coming & ~known]).all()
    pixels = estimate.part(Tile(3, 5, 2, 19, 13))
    assert (pixels.shape, pixels.dtype) == ((11, 14, 3), np.float32)
    assert pixels.tobytes() == np.ascontiguousarray(image[2:13, 5:19]).tobytes()


def passes(estimate: Estimate, count: int) -> None:
    tile = whole(estimate)
    for _ in range(count):
        estimate.take(tile, render_samples(estimate.plan, tile, estimate.have, estimate.want))
        if not estimate.advance():
            return


@pytest.mark.parametrize("before", [0, 1, 3, 5, 6])
def test_an_estimate_that_is_put_away_and_taken_up_again_goes_on_with_the_same_bytes(before: int) -> None:
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
    told = estimate.settle()
    expected = np.sqrt(expected_errors(estimate.image().transpose(2, 0, 1)).mean(dtype=float))
    assert told.estimate == pytest.approx(expected, rel=1e-12)
    assert told.low <= told.estimate <= told.high <= told.bound


def test_a_lens_samples_every_pixel_at_once() -> None:
    view = pictures.of_room()["camera"] | {"lens_radius": 0.1}
    estimate = begun(plan_of(camera=view))
    assert (estimate.want == SAMPLED).all()
    assert estimate.shown.all()
    assert estimate.counters[STRIDE] == 1


def test_a_picture_counts_one_sample_where_it_was_looked_at_and_none_in_between() -> None:
    estimate, _ = taken(rising())
    expected = np.where(estimate.have > LOOKED, 2 ** estimate.have.astype(int), estimate.have)
    assert (estimate.counts() == expected).all()
