"""Counting pixels that share the noise of a reference, on pictures of which all is known."""

from __future__ import annotations

import io
import math
from statistics import NormalDist

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison.inputs import Picture, picture_of
from service.grading.likeness.closeness import BOUND, FEWEST, LEVEL, NEAR, Closeness, closeness

SIDE = 96
TRUTH = 0.3
NOISE = 0.05
SAMPLES = 64


def picture(values: np.ndarray, error: float | np.ndarray | None = None, samples: int = SAMPLES) -> Picture:
    """A floating-point picture of values (H, W), grey, with what it states of its noise."""
    shape = (*values.shape, 3)
    layers = {}
    if error is not None:
        layers["error"] = np.broadcast_to(np.asarray(error)[..., None], shape).astype(np.float32)
        layers["samples"] = np.full(values.shape, samples)
    buffer = io.BytesIO()
    np.save(buffer, np.broadcast_to(values[:, :, None], shape).astype(np.float32))
    return picture_of(buffer.getvalue(), "picture.npy", "linear", layers)


def eight_bits(values: np.ndarray) -> Picture:
    codes = np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(np.repeat(codes[:, :, None], 3, axis=2)).save(buffer, "PNG")
    return picture_of(buffer.getvalue(), "picture.png", "linear")


def noisy(seed: int, deviation: float = NOISE) -> np.ndarray:
    return np.random.default_rng(seed).normal(TRUTH, deviation, (SIDE, SIDE))


def counted(image: Picture, reference: Picture) -> Closeness:
    found = closeness(image, reference)
    assert found is not None
    return found


def test_a_flawless_picture_is_near_as_often_as_normal_noise_is_small() -> None:
    found = counted(picture(np.full((SIDE, SIDE), TRUTH)), picture(noisy(1), NOISE))
    share = 2 * NormalDist().cdf(NEAR) - 1
    assert found.pixels > 0.95 * SIDE * SIDE
    # Six deviations of a binomial count: one failure in 10^9 seeds.
    spread = math.sqrt(found.pixels * share * (1 - share))
    assert abs(found.near - share * found.pixels) < 6 * spread
    assert not found.suspicious


@pytest.mark.parametrize("made", [picture, eight_bits])
def test_a_picture_made_from_the_reference_is_near_everywhere(made: object) -> None:
    values = noisy(2)
    found = counted(made(values), picture(values, NOISE))  # type: ignore[operator]
    assert found.near == found.pixels > 0.95 * SIDE * SIDE
    assert found.suspicious


def test_noise_of_its_own_clears_a_picture_of_suspicion() -> None:
    reference = picture(noisy(3), NOISE)
    assert not counted(picture(noisy(4)), reference).suspicious
    assert not counted(picture(noisy(5, 4 * NOISE)), reference).suspicious


def test_the_worst_yes_or_no_noise_stays_below_the_bound() -> None:
    """Three pixels in four have one yes among all samples; those without a yes show no noise."""
    chance = 0.75 / FEWEST
    hits = np.random.default_rng(6).binomial(FEWEST, chance, (SIDE, SIDE))
    error = np.sqrt(hits * (FEWEST - hits) / FEWEST**2 / (FEWEST - 1))
    found = counted(picture(np.full((SIDE, SIDE), chance)), picture(hits / FEWEST, error, FEWEST))
    once = FEWEST * chance * (1 - chance) ** (FEWEST - 1)
    share = once / (1 - (1 - chance) ** FEWEST)
    assert share < BOUND
    assert abs(found.near - share * found.pixels) < 6 * math.sqrt(found.pixels * share * (1 - share))
    assert not found.suspicious


@pytest.mark.parametrize("near", [0, 700, 1000])
def test_suspicion_begins_where_chernoffs_bound_falls_below_the_level(near: int) -> None:
    share = near / 1000
    bound = 1.0
    if share > BOUND:
        rest = ((1 - BOUND) / (1 - share)) ** (1 - share) if share < 1 else 1.0
        bound = ((BOUND / share) ** share * rest) ** 1000
    assert Closeness(1000, near).suspicious == (bound <= LEVEL)


def test_the_bound_is_met_between_two_counts() -> None:
    suspicious = [Closeness(1000, near).suspicious for near in range(1001)]
    first = suspicious.index(True)
    assert all(suspicious[first:])
    # The exact tail of the binomial is below Chernoff's bound.
    tail = sum(math.comb(1000, k) * 0.7**k * 0.3 ** (1000 - k) for k in range(first, 1001))
    assert tail <= LEVEL


def test_few_pixels_are_never_enough() -> None:
    assert not Closeness(0, 0).suspicious
    assert not Closeness(30, 30).suspicious


def test_errors_that_are_stated_too_large_do_not_count() -> None:
    """Stratified samples err less than they say: a flawless picture must not pass for a copy."""
    found = counted(picture(np.full((SIDE, SIDE), TRUTH)), picture(noisy(7, NOISE / 8), NOISE))
    assert found.pixels == 0


@pytest.mark.parametrize("contrast", [0.1, 0.2, 0.4])
def test_edges_do_not_count_as_noise(contrast: float) -> None:
    edges = np.tile(TRUTH + contrast * (np.arange(SIDE) % 8 < 4), (SIDE, 1))
    assert counted(picture(edges), picture(edges, NOISE)).pixels == 0


def test_noise_on_strong_edges_does_not_count() -> None:
    edges = np.tile(0.5 * (np.arange(SIDE) % 8 < 4), (SIDE, 1))
    assert counted(picture(edges), picture(edges + noisy(12), NOISE)).pixels == 0


def test_what_is_clipped_or_lost_in_rounding_does_not_count() -> None:
    reference = picture(noisy(8), NOISE)
    bright = noisy(9) + 0.95 - TRUTH
    clear = np.count_nonzero(bright + 2 * NOISE < 1)
    assert 0 < counted(picture(bright), picture(bright, NOISE)).pixels <= clear < SIDE * SIDE / 2
    fine = picture(TRUTH + (noisy(8) - TRUTH) / 64, NOISE / 64)
    assert counted(eight_bits(noisy(8)), fine).pixels == 0
    assert counted(eight_bits(noisy(8)), reference).pixels > 0.95 * SIDE * SIDE


def test_a_reference_of_few_samples_or_without_its_noise_shows_nothing() -> None:
    values = noisy(10)
    assert counted(picture(values), picture(values, NOISE, FEWEST - 1)).pixels == 0
    assert closeness(picture(values), picture(values)) is None


def test_what_the_picture_says_of_its_own_noise_is_not_believed() -> None:
    values = noisy(11)
    assert counted(picture(values, 100.0), picture(values, NOISE)).suspicious
