"""Pixels by what is expected of their pilot sample."""

import math
from fractions import Fraction

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import Json, camera, phong, scene, sphere
from renderer.adaptive import Estimate, strata
from renderer.adaptive.decisions import advance
from renderer.adaptive.early_passes import BENT, PROBED, cover_borders
from renderer.adaptive.levels import COVERED, PREVIEWED
from renderer.adaptive.neighbours import borders
from renderer.adaptive.states import State
from renderer.adaptive.strata import (
    BORDER,
    COUNT,
    EVEN,
    INTERPOLATED,
    NEEDS_SAMPLING,
    STEPS,
    SUSPECT,
)
from schemas.quality import TargetQuality
from tests.pictures.parts import Files, png
from tests.pictures.pictures import codes


def grey(rows: object) -> np.ndarray:
    return np.repeat(np.array(rows, dtype=np.float32)[None], 3, axis=0)


def squared_error_of_a_step(parts: int) -> Fraction:
    """Of the value in a pixel's middle, mean over a step of height 1 at the middles of parts of the pixel."""
    total = Fraction(0)
    for part in range(parts):
        place = Fraction(2 * part + 1, 2 * parts)
        mean, middle = 1 - place, Fraction(place < Fraction(1, 2))
        total += (middle - mean) ** 2
    return total / parts


@pytest.mark.parametrize("height", [1.0, 0.5, 2.0**-6])
@pytest.mark.parametrize("turned", [True, False])
def test_a_step_is_expected_to_err_by_its_mean_over_all_its_places(height: float, turned: bool) -> None:
    """That is 1 / 12 of its square: the mean over n parts tends to it by 1 / (12 n n)."""
    n = 64
    mean = squared_error_of_a_step(n)
    assert abs(mean - Fraction(1, 12)) <= Fraction(1, 12 * n * n)
    picture = grey(np.arange(9) * np.ones((7, 1)) > 4) * np.float32(height)
    found = strata.expected_errors(picture.transpose(0, 2, 1) if turned else picture)
    found = found.T if turned else found
    np.testing.assert_allclose(found[:, 4:6], height**2 / 12, rtol=4 * 2.0**-24)
    assert not found[:, :3].any()
    assert not found[:, 7:].any()


def test_a_step_in_one_channel_counts_a_third() -> None:
    picture = np.zeros((3, 5, 8), np.float32)
    picture[1, :, 4:] = 1
    found = strata.expected_errors(picture)
    np.testing.assert_allclose(found[:, 3:5], 1 / 36, rtol=2.0**-23)


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (2, 1), (2, 2), (1, 9), (9, 1), (5, 7)])
def test_of_planes_no_error_is_expected(size: tuple[int, int]) -> None:
    y, x = np.indices(size)
    found = strata.expected_errors(grey(x / 16 + y / 32))
    assert (found.shape, found.dtype) == (size, np.float32)
    assert not found.any()


def test_of_what_is_brighter_than_white_no_error_is_expected() -> None:
    y, x = np.indices((6, 6))
    assert not strata.expected_errors(grey(1 + (x + y) % 2 * 100)).any()


def test_a_bend_in_a_single_row_is_seen() -> None:
    assert strata.expected_errors(grey([[0, 0, 0, 1, 1, 1]])).any()


@pytest.mark.parametrize("step", range(STEPS))
def test_a_stratum_is_one_and_a_half_octaves_of_expected_error(step: int) -> None:
    low = 2.0 ** (-36 + 1.5 * step)
    inside = np.array([[low * 2**0.01, low * 2**0.75, low * 2**1.49]], np.float32)
    found = strata.strata_of(inside, np.full((1, 3), PREVIEWED, np.uint8), np.zeros((1, 3), bool))
    assert (found == step + STEPS * EVEN).all()


def test_nothing_and_too_much_are_in_the_first_and_last_strata_of_their_kind() -> None:
    expected, have = np.array([[0, 9]], np.float32), np.full((1, 2), PREVIEWED, np.uint8)
    found = strata.strata_of(expected, have, np.zeros((1, 2), bool))
    assert found.tolist() == [[STEPS * EVEN, STEPS * EVEN + STEPS - 1]]


def test_each_pixel_is_of_the_kind_that_it_shows() -> None:
    """What is interpolated is not known to show something fine."""
    have = np.array([[0, PREVIEWED, COVERED]] * 2, np.uint8)
    needs_sampling = np.array([[False] * 3, [True] * 3])
    found = strata.strata_of(np.zeros((2, 3), np.float32), have, needs_sampling) // STEPS
    assert found.tolist() == [[INTERPOLATED, EVEN, BORDER], [INTERPOLATED, NEEDS_SAMPLING, NEEDS_SAMPLING]]


TARGET = TargetQuality(mode="target", error=4 / 255)

SURFACES: dict[str, Json] = {
    "plain": phong(),
    "picture": phong(color_texture="picture"),
    "board": phong(color_texture="board"),
    "mirror": phong(mirror=0.5),
}


def previewed() -> Estimate:
    """A grey picture of four balls, of which only pilot samples and what they hit are known."""
    document = scene(
        *(sphere([0, 0, 0], 1, material=name) for name in SURFACES),
        camera=camera(width=40, height=24),
        materials=SURFACES,
        textures={"picture": {"type": "image", "asset": "picture.png"}, "board": {"type": "checker"}},
    )
    loaded = renderer.load_scene(document, assets=Files({"picture.png": png(codes(4, 4))}))
    estimate = Estimate.begin(renderer.compile_scene(loaded, TARGET))
    estimate.state = State.BORDERS
    estimate.values[...], estimate.have[...] = 0.25, PREVIEWED
    return estimate


def test_what_is_finer_than_pixels_takes_the_highest_expectation_up_to_two_pixels_away() -> None:
    """Pictures and mirrors are; a checker board is not, as its mean is known, nor what is plain."""
    estimate = previewed()
    estimate.labels[...] = np.arange(40) // 10
    estimate.values[:, 12, 5::10] = 0.75
    estimate.values[:, 3, 9] = 0.5
    expected = strata.expected_errors(estimate.values)
    needs_sampling = (estimate.labels == 1) | (estimate.labels == 3)
    most = expected.copy()
    for y, x in np.argwhere(needs_sampling):
        most[y, x] = expected[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].max()
    assert (most > expected).any()
    cover_borders(estimate)
    assert advance(estimate)
    assert (estimate.strata == strata.strata_of(most, estimate.have, needs_sampling)).all()
    assert (estimate.strata[needs_sampling] // STEPS == NEEDS_SAMPLING).all()
    assert (estimate.strata[~needs_sampling] // STEPS == EVEN).all()


def test_of_a_board_whose_light_is_even_little_error_is_expected_but_beside_another_shape() -> None:
    """A light of 1/2 leaves half of each colour, without rounding."""
    estimate = previewed()
    estimate.labels[...] = 2
    estimate.labels[:, :8] = 0
    estimate.colors[...] = np.random.default_rng(2).random((3, 24, 40))
    estimate.values[...] = estimate.colors / 2
    expected = strata.expected_errors(estimate.values)
    expected[:, 9:] *= BENT
    cover_borders(estimate)
    assert advance(estimate)
    nothing = np.zeros(expected.shape, bool)
    assert (estimate.strata == strata.strata_of(expected, estimate.have, nothing)).all()


def test_a_shadow_that_ends_beside_a_border_is_expected_though_the_border_shows_means() -> None:
    """Rows 0 to 7 show the background, the others a shape; a shadow lies on the first row of that."""
    estimate = previewed()
    estimate.labels[:8] = -1
    estimate.values[:, 9:] = 0.75
    cover_borders(estimate)
    covered = estimate.cover > 0
    assert not covered[9:-1, 5:-5].any()
    covered[7:9] = True
    estimate.have[covered], estimate.coverage[covered] = COVERED, 5
    estimate.values[:, 8] = 0.75
    assert advance(estimate)
    expected = np.array([[0.5**2 / 12, 0]], dtype=np.float32)
    sharp, even = strata.strata_of(expected, np.full((1, 2), PREVIEWED, np.uint8), np.zeros((1, 2), bool))[0]
    assert (estimate.strata[9, 5:-5] == sharp).all()
    assert (estimate.strata[11:-2, 5:-5] == even).all()


def beside_something_bright(brightness: float) -> Estimate:
    """A block of two shapes in the dark; it covers three quarters of the pixels at its border."""
    estimate = previewed()
    estimate.labels[8:16, 12:20], estimate.labels[8:16, 20:28] = 1, 2
    estimate.values[:, 8:16, 12:28] = brightness
    edges = borders(estimate.labels)
    edges[0] = True
    estimate.have[edges], estimate.coverage[edges] = COVERED, 5
    pilots = estimate.values[0].copy()
    estimate.values[:, edges & (estimate.labels > 0)] = (3 * brightness + 0.25) / 4
    estimate.pilots[...] = pilots
    assert advance(estimate)
    return estimate


def test_where_something_brighter_than_white_ends_samples_are_taken_at_once() -> None:
    """With the probes, in all pixels at the border that are, or are beside, both brighter and darker ones."""
    estimate = beside_something_bright(8.0)
    assert (estimate.have[8:16, 19:21] == COVERED).all()
    bright = np.pad(estimate.pilots[0], 1, mode="edge") > 1
    sampled = np.zeros(estimate.have.shape, bool)
    for y, x in np.argwhere(estimate.have == COVERED):
        around = bright[y : y + 3, x : x + 3]
        sampled[y, x] = around.any() and not around.all()
    assert sampled.sum() == 18 * 10 - 14 * 6  # two pixels wide, around 16 x 8
    assert (estimate.shown == sampled).all()
    assert (estimate.want[sampled] == PROBED).all()
    assert (estimate.strata[sampled] // STEPS == SUSPECT).all()
    assert (estimate.strata[~sampled] // STEPS != SUSPECT).all()


def test_where_nothing_is_brighter_than_white_no_border_is_sampled_at_once() -> None:
    estimate = beside_something_bright(1.0)
    assert not estimate.shown.any()
    assert (estimate.strata // STEPS != SUSPECT).all()


def test_of_every_stratum_enough_pixels_are_probed_and_of_the_worse_more() -> None:
    random = np.random.default_rng(3)
    sorts = random.choice([0, 5, 30, 47, 90], size=(64, 96), p=[0.6, 0.2, 0.15, 0.049, 0.001])
    expected = (random.random(sorts.shape) ** 4).astype(np.float32) * (sorts == 30) / 4
    share, budget = 1 / 128, 2.0
    found = strata.probe_probability(sorts, expected, share, budget)
    assert found.shape == (COUNT,)
    assert ((found > 0) & (found <= 1)).all()
    for stratum in np.unique(sorts):
        inside = sorts == stratum
        size, error = inside.sum(), expected[inside].sum(dtype=float)
        assert found[stratum] * size >= min(size, share * size)
        assert found[stratum] * size >= min(size, 16) * (1 - 2.0**-50)
        assert found[stratum] * size >= min(size, 50 * error / budget) * (1 - 2.0**-20)
    assert found[90] == 1
    assert found[5] < 1


def test_ranks_are_uniform_and_those_of_neighbours_and_seeds_are_independent() -> None:
    """All within 5 standard deviations of independent numbers."""
    ranks, other = strata.probe_ranks(7, (300, 200)), strata.probe_ranks(8, (300, 200))
    assert ((ranks >= 0) & (ranks < 1)).all()
    cells = np.bincount((ranks * 32).astype(int).ravel(), minlength=32)
    expected = ranks.size / 32
    assert np.abs(cells - expected).max() <= 5 * math.sqrt(expected)
    for a, b in (
        (ranks[1:], ranks[:-1]),
        (ranks[:, 1:], ranks[:, :-1]),
        (ranks, other),
    ):
        correlation = 12 * ((a - 0.5) * (b - 0.5)).mean()
        assert abs(correlation) <= 5 / math.sqrt(a.size)


def test_the_rank_of_a_pixel_depends_on_its_number_alone() -> None:
    assert (strata.probe_ranks(7, (30, 20)).ravel() == strata.probe_ranks(7, (1, 600)).ravel()).all()
    assert (strata.probe_ranks(7, (10, 20)) == strata.probe_ranks(7, (30, 20))[:10]).all()
