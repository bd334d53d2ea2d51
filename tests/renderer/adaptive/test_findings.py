"""Errors estimated from samples: without bias, and none where a pixel is too bright to be seen."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import camera, scene, sphere
from renderer.adaptive import Estimate, Samples
from renderer.adaptive.decisions import FIND, NEAR, WORTH, advance
from renderer.adaptive.findings import GLARE, UNMODELLED, errors_of, findings_of
from renderer.adaptive.levels import COUNTS, PREVIEWED, SAMPLED
from renderer.adaptive.states import State
from renderer.adaptive.strata import COUNT, STEPS, SUSPECT, typical_error
from schemas.quality import TargetQuality
from schemas.tiles import Tile

SIZE = 48, 40


Numbers = NDArray[np.float64]


def known(seed: int = 1) -> tuple[dict[str, Any], Numbers, Numbers]:
    """A grey picture, half of it sampled and shown; what it truly is; and the noise of either half."""
    random = np.random.default_rng(seed)
    truth = random.uniform(0.3, 0.7, SIZE)
    noise = random.uniform(0.005, 0.03, SIZE)
    halves = truth + noise * random.normal(size=(2, *SIZE))
    shown = np.zeros(SIZE, bool)
    shown[:, :20] = True
    have = np.where(random.random(SIZE) < 0.4, SAMPLED + 1, PREVIEWED).astype(np.uint8)
    have[shown] = random.choice([SAMPLED, SAMPLED + 2, SAMPLED + 5], SIZE)[shown]
    pilots = np.repeat((truth + random.uniform(-0.05, 0.05, SIZE))[None], 3, axis=0).astype(np.float32)
    arrays = {
        "halves": np.repeat(halves[:, None], 3, axis=1),
        "squares": random.random(SIZE) * COUNTS[have],
        "have": have,
        "shown": shown,
        "probing": ~shown,
        "pilots": pilots,
        "strata": random.choice([3, 40, 60], SIZE),
        "spread": np.zeros(SIZE, np.float32),
        "lit": np.zeros(SIZE, bool),
    }
    return arrays, truth, noise


def test_pixels_are_sampled_ones_that_show_samples_and_probes_that_do_not() -> None:
    arrays, _, _ = known()
    found = findings_of(**arrays)
    taken, shown = arrays["have"] >= SAMPLED, arrays["shown"]
    assert found.sampled.tolist() == np.flatnonzero(taken & shown).tolist()
    assert found.probes.tolist() == np.flatnonzero(taken & ~shown).tolist()
    sizes = np.bincount(arrays["strata"][~shown], minlength=COUNT)
    assert found.survey.sizes.tolist() == sizes.tolist()


def test_shown_pixels_may_probe_pilot_samples_as_well() -> None:
    """They are probes then as well, but none of the pixels whose pilot sample is shown."""
    arrays, _, _ = known()
    apart = findings_of(**arrays)
    arrays["probing"] |= arrays["strata"] == 40
    found = findings_of(**arrays)
    taken = arrays["have"] >= SAMPLED
    assert found.probes.tolist() == np.flatnonzero(taken & arrays["probing"]).tolist()
    assert found.sampled.tolist() == apart.sampled.tolist()
    assert found.survey.sizes.tolist() == apart.survey.sizes.tolist()
    assert found.squares.tolist() == apart.squares.tolist()
    pilots, means = arrays["pilots"][0].astype(float), arrays["halves"][:, 0]
    of_it = taken & (arrays["strata"] == 40)
    errors = ((means[0] - pilots) * (means[1] - pilots))[of_it]
    assert found.survey.errors[40] == pytest.approx(math.fsum(errors) / errors.size, rel=1e-12)
    assert found.survey.errors[3] == apart.survey.errors[3]


def variances_of(arrays: dict[str, Any]) -> tuple[Numbers, Numbers, Numbers]:
    """Of single samples of shown pixels: their own, the mean around, and what n samples leave of one."""
    single = arrays["squares"] / np.maximum(COUNTS[arrays["have"]] - 1, 1)
    around = []
    for y, x in np.argwhere(arrays["shown"]):
        part = np.s_[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        around.append(math.fsum(single[part][arrays["shown"][part]]) / arrays["shown"][part].sum())
    shares = COUNTS[arrays["have"]][arrays["shown"]] ** -1.5
    return single[arrays["shown"]], np.array(around), shares


def joined(arrays: dict[str, Any], differences: Numbers) -> Numbers:
    """Squared errors (n,) of shown pixels from those estimated by their halves."""
    own, around, shares = variances_of(arrays)
    scale = math.fsum(differences) / math.fsum(own * shares)
    errors: Numbers = (differences + scale * around * shares) / 2
    return errors


def test_half_of_a_squared_error_is_that_of_the_halves_and_half_that_of_the_variances_around() -> None:
    """The halves give a quarter of their squared difference. Variances are scaled to give the same total."""
    arrays, _, _ = known()
    arrays["halves"] = np.random.default_rng(4).uniform(-0.2, 1.2, (2, 3, *SIZE))
    found = findings_of(**arrays)
    a, b = np.clip(arrays["halves"], 0, 1)
    own = [((a[:, y, x] - b[:, y, x]) ** 2).sum() / 12 for y, x in np.argwhere(arrays["shown"])]
    np.testing.assert_allclose(found.squares, joined(arrays, np.array(own)), rtol=1e-12, atol=0)


def test_where_no_sample_differs_from_another_the_halves_alone_count() -> None:
    arrays, _, _ = known()
    arrays["squares"][...] = 0
    found = findings_of(**arrays)
    a, b = arrays["halves"][:, 0][:, arrays["shown"]]
    np.testing.assert_allclose(found.squares, (a - b) ** 2 / 4, rtol=1e-12)
    assert not found.variances.any()


@pytest.mark.parametrize("seed", range(4))
def test_the_total_is_the_sum_of_all_squared_errors_without_bias(seed: int) -> None:
    """Within 5 standard deviations: of Gaussian noise s in each half, and of which pixels are probes."""
    arrays, truth, noise = known(seed)
    found = findings_of(**arrays)
    shown = arrays["shown"]
    sampled = (noise[shown] ** 2 / 2).sum()
    deviation = math.sqrt(2) * np.linalg.norm(noise[shown] ** 2 / 2)
    assert abs(found.squares.sum() - sampled) <= 5 * deviation
    errors = (arrays["pilots"][0].astype(float) - truth) ** 2
    pilots, variance = errors[~shown].sum(), 0.0
    for stratum in np.unique(arrays["strata"]):
        inside = ~shown & (arrays["strata"] == stratum)
        probes = inside & (arrays["have"] >= SAMPLED)
        spread = errors[inside].var() + (2 * errors[inside] * noise[inside] ** 2 + noise[inside] ** 4).mean()
        variance += inside.sum() ** 2 * spread / probes.sum()
    assert abs(found.survey.total - pilots) <= 5 * math.sqrt(variance)
    assert found.total == found.squares.sum() + found.survey.total


def test_the_variance_of_the_total_is_no_less_than_it_is() -> None:
    """Mean over 40 pictures; twice the sum of squares of s * s / 2 is that of Gaussian halves."""
    estimated, true = 0.0, 0.0
    for seed in range(40):
        arrays, _, noise = known(seed)
        arrays["shown"][...], arrays["probing"][...] = True, False
        arrays["have"][...] = SAMPLED + 1
        estimated += findings_of(**arrays).variance
        true += 2 * float(((noise**2 / 2) ** 2).sum())
    assert estimated >= true


def test_squared_errors_of_shares_at_borders_come_on_top() -> None:
    """Two lattices estimate a squared error as two halves do: its variance is twice its square."""
    arrays, _, _ = known()
    without = findings_of(**arrays)
    arrays["spread"][3:5, 2:30] = np.random.default_rng(6).random((2, 28)) / 1000
    found = findings_of(**arrays)
    spread = arrays["spread"].astype(float)
    assert found.spread.tolist() == spread[3:5, 2:30].ravel().tolist()
    assert found.total == pytest.approx(without.total + math.fsum(spread.ravel()), rel=1e-12)
    more = 2 * math.fsum(spread.ravel() ** 2) + UNMODELLED**2 * (found.total**2 - without.total**2)
    assert found.variance == pytest.approx(without.variance + more, rel=1e-12)
    assert found.squares.tolist() == without.squares.tolist()
    assert found.survey.total == without.survey.total


def test_bright_pixels_have_no_error_and_ask_for_no_samples() -> None:
    arrays, _, _ = known()
    arrays["halves"] += 1.5
    found = findings_of(**arrays)
    assert not found.squares.any()
    assert not found.variances.any()


def test_the_variance_of_a_bright_pixel_is_not_expected_of_its_neighbours() -> None:
    """It says how bright single samples are, no more: so bright that all samples may have missed them."""
    arrays, _, _ = known()
    arrays["halves"][:, :, 10, 10] = np.array([[2.0, 3.0, 1.5], [4.0, 1.1, 2.5]])
    arrays["squares"][10, 10] = 1e12
    bright = findings_of(**arrays)
    arrays["squares"][10, 10] = 1e13
    brighter = findings_of(**arrays)
    assert bright.squares[10 * 20 + 10] == 0
    np.testing.assert_allclose(brighter.variances, bright.variances, rtol=1e-6)


def test_samples_beside_a_pixel_brighter_than_white_may_have_missed_what_is() -> None:
    """With the probability that as many samples miss the share that makes a pixel white.

    How bright single samples of the pixel are follows from their mean and their variance.
    """
    arrays, _, _ = known()
    found = {}
    arrays["halves"][:, :, 10, 10] = mean = 5.0
    for brightness in (96.0, 5.0):
        variance = mean * (brightness - mean)
        arrays["squares"][10, 10] = variance * (COUNTS[arrays["have"][10, 10]] - 1)
        found[brightness] = findings_of(**arrays).squares.reshape(SIZE[0], 20)
    more = found[96.0] - found[5.0]
    part = np.s_[9:12, 9:12]
    counts = COUNTS[arrays["have"][part]]
    dark = (1 - arrays["halves"][:, 0][:, *part].mean(axis=0)).clip(0) ** 2
    expected = GLARE * (np.exp(-counts / 96.0) - np.exp(-counts / 5.0)) * dark
    np.testing.assert_allclose(more[part], expected, rtol=1e-9, atol=0)
    more[part] = 0
    assert not more.any()


def test_samples_may_have_missed_what_rays_at_the_border_saw() -> None:
    arrays, _, _ = known()
    arrays["halves"][1], arrays["squares"] = arrays["halves"][0], np.zeros(SIZE)
    assert not findings_of(**arrays).squares.any()
    arrays["pilots"][:, 10, 10] = 50
    found = findings_of(**arrays)
    count, own = COUNTS[arrays["have"][10, 10]], 10 * 20 + 10
    missed = GLARE * math.exp(-count / 50) * (1 - arrays["halves"][0, 0, 10, 10]) ** 2
    assert found.squares[own] == pytest.approx(missed, rel=1e-9)
    assert found.variances[own] == pytest.approx(missed * count**1.5, rel=1e-9)


def test_a_pixel_that_is_bright_in_two_channels_still_counts_by_the_third() -> None:
    arrays, _, _ = known()
    arrays["halves"][:, :2] += 5
    found = findings_of(**arrays)
    a, b = arrays["halves"][:, 2][:, arrays["shown"]]
    np.testing.assert_allclose(found.squares, joined(arrays, (a - b) ** 2 / 12), rtol=1e-12)
    assert (found.variances > 0).all()


def test_no_variance_is_below_the_mean_around_it_and_together_they_explain_the_squared_errors() -> None:
    arrays, _, _ = known()
    arrays["squares"][arrays["shown"] & (np.random.default_rng(3).random(SIZE) < 0.7)] = 0
    found = findings_of(**arrays)
    own, around, shares = variances_of(arrays)
    scale = math.fsum(found.squares) / math.fsum(np.maximum(own, around) * shares)
    np.testing.assert_allclose(found.variances, scale * np.maximum(own, around), rtol=1e-12)


def test_what_is_not_shown_guards_no_pixel() -> None:
    """Squares of pixels that never had samples, and of probes, are not those of their shown neighbours."""
    arrays, _, _ = known()
    found = findings_of(**arrays)
    arrays["squares"][~arrays["shown"]] *= 1000
    again = findings_of(**arrays)
    assert (found.variances == again.variances).all()
    assert found.survey.variances * 1000 == pytest.approx(again.survey.variances, rel=1e-12)


def test_errors_of_pilot_samples_are_those_of_pictures_clipped_to_white() -> None:
    arrays, _, _ = known()
    arrays["halves"][...], arrays["pilots"][...] = 3.0, 17.0
    found = findings_of(**arrays)
    assert not found.errors.any()
    arrays["pilots"][...] = 0.5
    assert (findings_of(**arrays).errors == 0.25).all()


@pytest.mark.parametrize("error", [0.05, 0.3])
def test_the_noise_of_an_error_is_its_variance(error: float) -> None:
    """Grey halves with Gaussian noise s: 2 e e s s + s**4. Within 5 standard errors of means of 100,000.

    No error seems negative, as e is 10 s or more. The pilot sample is e away up to its rounding to
    float32.
    """
    random, n, s = np.random.default_rng(8), 100_000, 0.005
    halves = np.repeat(0.35 + s * random.normal(size=(2, 1, n)), 3, axis=1)
    errors, noise = errors_of(halves, np.full((3, n), 0.35 + error, np.float32))
    true = 2 * error**2 * s**2 + s**4
    assert abs(errors.mean() - error**2) <= 5 * math.sqrt(true / n) + 2.0**-24
    assert abs(noise.mean() - true) <= 5 * noise.std() / math.sqrt(n) + true * 2.0**-23 / error
    squares = (errors - error**2) ** 2
    assert abs(squares.mean() - true) <= 5 * squares.std() / math.sqrt(n) + true * 2.0**-23 / error
    assert (errors > 0).all()


def test_halves_that_agree_leave_an_error_no_noise_however_large_it_is() -> None:
    halves = np.array([0.75, 0.75])[:, None, None] * np.ones((2, 3, 1))
    apart = np.array([1.0, 0.5])[:, None, None] * np.ones((2, 3, 1))
    pilots = np.full((3, 1), 0.25, np.float32)
    assert errors_of(halves, pilots) == (1 / 4, 0)
    # Halves 1/2 apart have s s = 1/8; the error is 3/4 times 1/4.
    assert errors_of(apart, pilots) == (3 / 16, 1 / 8 * (3 / 8 + 1 / 8))


def test_each_probe_comes_with_the_noise_of_its_error() -> None:
    arrays, _, _ = known()
    found = findings_of(**arrays)
    where = np.unravel_index(found.probes, SIZE)
    errors, noise = errors_of(arrays["halves"][:, :, *where], arrays["pilots"][:, *where])
    assert (found.errors == errors).all()
    assert (found.noise == noise).all()
    assert (noise > 0).all()


def test_a_picture_without_samples_has_the_error_that_is_expected_of_it() -> None:
    arrays, _, _ = known()
    arrays["have"][...] = PREVIEWED
    found = findings_of(**arrays)
    pilots = arrays["strata"][~arrays["shown"]]
    assert found.total == pytest.approx(float(typical_error(pilots).sum()), rel=1e-12)
    alike = np.bincount(pilots) * typical_error(np.arange(pilots.max() + 1))
    unmodelled = (UNMODELLED * found.total) ** 2
    assert found.variance == pytest.approx(float((alike**2).sum()) + unmodelled, rel=1e-12)
    assert found.sampled.size == found.probes.size == found.variances.size == 0


GREY = 1 / 4


PROBABILITY = 2 / 5


def probed(probability: float = PROBABILITY) -> Estimate:
    """A grey picture that wants probes, in two of five pixels or another share of them."""
    document = scene(sphere([0, 0, 0], 1), camera=camera(width=96, height=64))
    estimate = Estimate.begin(renderer.compile_scene(document, TargetQuality(mode="target", error=4 / 255)))
    estimate.state = State.BORDERS
    estimate.values[...], estimate.have[...], estimate.probe_probability[...] = GREY, PREVIEWED, probability
    assert advance(estimate)
    return estimate


def searched(estimate: Estimate, others: float, find: tuple[float, float]) -> NDArray[np.bool_]:
    """Suspects (H, W) when all probes but the middle one have found some squared error, and that one more."""
    count = int((estimate.want > estimate.have).sum())
    halves = np.full((2, 3, count), GREY + math.sqrt(others), np.float32)
    halves[:, :, count // 2] = np.array(find)[:, None]
    empty, squares = np.zeros((3, 0), np.float32), np.zeros(count, np.float32)
    nothing = np.zeros(0, np.int32)
    none = squares[:0]
    samples = Samples(
        empty, nothing, empty, none, empty, empty, none, none, halves, squares, squares > 0, {}, {}, 0.0
    )
    estimate.take(Tile(0, 0, 0, 96, 64), samples)
    assert advance(estimate)
    return estimate.strata // STEPS == SUSPECT


@pytest.mark.parametrize(
    ("find", "clear"),
    [
        ((3 / 4, 3 / 4), True),
        ((4 / 5, 31 / 44), True),
        ((7 / 8, 13 / 20), False),
        ((1, 7 / 12), False),
        ((5 / 4, 3 / 2), True),
    ],
)
def test_a_find_makes_suspects_of_all_around_it_if_it_is_clear_of_its_noise(
    find: tuple[float, float], clear: bool
) -> None:
    """All but the last have a squared error of 1/4; halves d apart give it the variance d d (1 + d d) / 4, so
    that it is four standard deviations for d = 0.124. Of the last, whiter than white, both halves are white.
    """
    estimate = probed()
    places = np.argwhere(estimate.want > estimate.have)
    suspects = searched(estimate, 1.2 * estimate.target**2, find)
    expected = np.zeros_like(suspects)
    if clear:
        y, x = places[len(places) // 2]
        expected[y - NEAR : y + NEAR + 1, x - NEAR : x + NEAR + 1] = True
        assert expected.sum() == (2 * NEAR + 1) ** 2
    assert (suspects == expected).all()
    assert estimate.shown[suspects].all()
    assert (estimate.want[suspects] > estimate.have[suspects]).all()


@pytest.mark.parametrize(("part", "expected"), [(0.9, False), (1.1, True)])
def test_a_find_is_worth_a_search_if_what_it_speaks_for_errs_by_a_share_of_the_budget(
    part: float, expected: bool
) -> None:
    """It speaks for the pixels that are to one probe; the others err by a little more than was requested."""
    estimate = probed()
    others, least = 1.2 * estimate.target**2, WORTH * estimate.budget * PROBABILITY
    assert part * least > FIND * others
    find = GREY + math.sqrt(part * least)
    assert searched(estimate, others, (find, find)).any() == expected


@pytest.mark.parametrize(("probability", "whole"), [(2 / 5, False), (3 / 5, True)])
def test_a_sort_most_of_whose_pixels_are_probes_shows_32_samples_of_each(
    probability: float, whole: bool
) -> None:
    estimate = probed(probability)
    searched(estimate, 1.2 * estimate.target**2, (GREY, GREY))
    assert estimate.shown.all()
    assert (COUNTS[estimate.want] >= 32).all() == whole
