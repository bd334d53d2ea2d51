"""What samples tell of errors: without bias, and of what is too bright to be seen, nothing."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.adaptive.findings import findings_of
from renderer.adaptive.levels import COUNTS
from renderer.adaptive.strata import COUNT

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
    have = np.where(random.random(SIZE) < 0.4, 3, 1).astype(np.uint8)
    have[shown] = random.choice([2, 4, 7], SIZE)[shown]
    looks = np.repeat((truth + random.uniform(-0.05, 0.05, SIZE))[None], 3, axis=0).astype(np.float32)
    arrays = {
        "halves": np.repeat(halves[:, None], 3, axis=1),
        "squares": random.random(SIZE) * COUNTS[have],
        "have": have,
        "shown": shown,
        "looks": looks,
        "strata": random.choice([3, 40, 60], SIZE),
    }
    return arrays, truth, noise


def test_pixels_are_sampled_ones_that_show_samples_and_probes_that_do_not() -> None:
    arrays, _, _ = known()
    told = findings_of(**arrays)
    taken, shown = arrays["have"] >= 2, arrays["shown"]
    assert told.sampled.tolist() == np.flatnonzero(taken & shown).tolist()
    assert told.probes.tolist() == np.flatnonzero(taken & ~shown).tolist()
    sizes = np.bincount(arrays["strata"][~shown], minlength=COUNT)
    assert told.survey.sizes.tolist() == sizes.tolist()


def test_the_squared_error_of_a_pixel_is_a_quarter_of_the_squared_difference_of_its_halves() -> None:
    arrays, _, _ = known()
    arrays["halves"] = np.random.default_rng(4).uniform(-0.2, 1.2, (2, 3, *SIZE))
    told = findings_of(**arrays)
    a, b = np.clip(arrays["halves"], 0, 1)
    expected = [((a[:, y, x] - b[:, y, x]) ** 2).sum() / 12 for y, x in np.argwhere(arrays["shown"])]
    np.testing.assert_allclose(told.squares, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("seed", range(4))
def test_the_total_is_the_sum_of_all_squared_errors_without_bias(seed: int) -> None:
    """Within 5 standard deviations: of Gaussian noise s in each half, and of which pixels are probes."""
    arrays, truth, noise = known(seed)
    told = findings_of(**arrays)
    shown = arrays["shown"]
    sampled = (noise[shown] ** 2 / 2).sum()
    deviation = math.sqrt(2) * np.linalg.norm(noise[shown] ** 2 / 2)
    assert abs(told.squares.sum() - sampled) <= 5 * deviation
    errors = (arrays["looks"][0].astype(float) - truth) ** 2
    looks, variance = errors[~shown].sum(), 0.0
    for stratum in np.unique(arrays["strata"]):
        inside = ~shown & (arrays["strata"] == stratum)
        probes = inside & (arrays["have"] > 1)
        spread = errors[inside].var() + (2 * errors[inside] * noise[inside] ** 2 + noise[inside] ** 4).mean()
        variance += inside.sum() ** 2 * spread / probes.sum()
    assert abs(told.survey.total - looks) <= 5 * math.sqrt(variance)
    assert told.total == told.squares.sum() + told.survey.total


def test_the_variance_of_the_total_is_no_less_than_it_is() -> None:
    """Mean over 40 pictures; twice the sum of squares of s * s / 2 is that of Gaussian halves."""
    told, true = 0.0, 0.0
    for seed in range(40):
        arrays, _, noise = known(seed)
        arrays["shown"][...] = True
        arrays["have"][...] = 3
        told += findings_of(**arrays).variance
        true += 2 * float(((noise**2 / 2) ** 2).sum())
    assert told >= true


def test_bright_pixels_have_no_error_and_ask_for_no_samples() -> None:
    arrays, _, _ = known()
    arrays["halves"] += 1.5
    told = findings_of(**arrays)
    assert not told.squares.any()
    assert not told.variances.any()


def test_a_bright_pixel_tells_its_neighbours_nothing() -> None:
    arrays, _, _ = known()
    arrays["halves"][:, :, 10, 10] = np.array([[2.0, 3.0, 1.5], [4.0, 1.1, 2.5]])
    arrays["squares"][10, 10] = 1e6
    with_it = findings_of(**arrays)
    arrays["squares"][10, 10] = 0
    without = findings_of(**arrays)
    assert with_it.squares[10 * 20 + 10] == 0
    assert (with_it.variances == without.variances).all()


def test_a_pixel_that_is_bright_in_two_channels_still_counts_by_the_third() -> None:
    arrays, _, _ = known()
    arrays["halves"][:, :2] += 5
    told = findings_of(**arrays)
    a, b = arrays["halves"][:, 2][:, arrays["shown"]]
    np.testing.assert_allclose(told.squares, (a - b) ** 2 / 12, rtol=1e-12)
    assert (told.variances > 0).all()


def test_no_variance_is_below_the_mean_around_it_and_all_explain_the_differences() -> None:
    arrays, _, _ = known()
    arrays["squares"][arrays["shown"] & (np.random.default_rng(3).random(SIZE) < 0.7)] = 0
    told = findings_of(**arrays)
    single = arrays["squares"] / np.maximum(COUNTS[arrays["have"]] - 1, 1)
    expected = []
    for y, x in np.argwhere(arrays["shown"]):
        part = np.s_[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        around = math.fsum(single[part][arrays["shown"][part]]) / arrays["shown"][part].sum()
        expected.append(max(single[y, x], around))
    # Means of nine are formed in two orders.
    np.testing.assert_allclose(
        told.variances / told.variances.max(), np.array(expected) / max(expected), rtol=1e-13
    )
    taken = COUNTS[arrays["have"]][arrays["shown"]]
    assert (told.variances * taken**-1.5).sum() == pytest.approx(told.squares.sum(), rel=1e-13)


def test_what_is_not_shown_guards_nobody() -> None:
    """Squares of pixels that never had samples, and of probes, are not those of their shown neighbours."""
    arrays, _, _ = known()
    told = findings_of(**arrays)
    arrays["squares"][~arrays["shown"]] *= 1000
    again = findings_of(**arrays)
    assert (told.variances == again.variances).all()
    assert told.survey.variances * 1000 == pytest.approx(again.survey.variances, rel=1e-12)


def test_errors_of_looks_are_those_of_pictures_clipped_to_white() -> None:
    arrays, _, _ = known()
    arrays["halves"][...], arrays["looks"][...] = 3.0, 17.0
    told = findings_of(**arrays)
    assert not told.errors.any()
    arrays["looks"][...] = 0.5
    assert (findings_of(**arrays).errors == 0.25).all()


def test_a_picture_without_samples_has_nothing_to_tell() -> None:
    arrays, _, _ = known()
    arrays["have"][...] = 1
    told = findings_of(**arrays)
    assert (told.total, told.variance) == (0, 0)
    assert told.sampled.size == told.probes.size == told.variances.size == 0
