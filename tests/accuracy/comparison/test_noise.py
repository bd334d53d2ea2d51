"""Noise bounded by that of the fewest samples, on pictures of which all is known."""

import io

import numpy as np
import pytest

from accuracy.comparison import Picture, Policy, compare, picture_of
from accuracy.comparison.blocks import bias
from accuracy.comparison.noise import allowed_variances, noise, sample_variances
from renderer.math.numerics import EPS

SIDE = 64
SINGLE = 0.04
"""Variance of one sample."""
MANY = 4096
"""Samples of the reference: its own noise is far below that of the pictures."""

STRICT = Policy(tolerance=0.0, samples=4)


def picture(values: np.ndarray, **layers: np.ndarray) -> Picture:
    buffer = io.BytesIO()
    np.save(buffer, values.astype(np.float32))
    return picture_of(buffer.getvalue(), "picture", "linear", layers)


def reference(value: float = 0.5) -> Picture:
    values = np.full((SIDE, SIDE, 3), value)
    return picture(
        values, error=np.full(values.shape, (SINGLE / MANY) ** 0.5), samples=np.full(values.shape[:2], MANY)
    )


def drawn(seed: int, samples: float, mean: float = 0.5) -> Picture:
    """Normal noise of so many samples."""
    random = np.random.default_rng(seed)
    return picture(random.normal(mean, (SINGLE / samples) ** 0.5, (SIDE, SIDE, 3)))


def test_variance_of_a_sample_is_from_error_and_samples() -> None:
    single = sample_variances(reference())
    assert single.ravel().tolist() == pytest.approx([SINGLE] * single.size, rel=64 * EPS)


def test_allowed_variance_adds_all_sources() -> None:
    rounding = np.full((SIDE, SIDE, 3), 0.03)
    allowed = allowed_variances(reference(), 4, rounding, 0.01)
    expected = SINGLE / 4 + SINGLE / MANY + 0.03**2 / 3 + 0.01**2
    assert allowed.ravel().tolist() == pytest.approx([expected] * allowed.size, rel=64 * EPS)


@pytest.mark.parametrize("samples", [1, 1.5])
def test_fewer_samples_are_not_accepted(samples: float) -> None:
    """1.5 samples have 2.7 times the variance that is allowed."""
    found = compare(drawn(3, samples), reference(), policy=STRICT)
    assert (found.judgement.verdict, found.judgement.test) == ("mismatch", "noise")


def test_noise_does_not_hide_a_brighter_block() -> None:
    random = np.random.default_rng(5)
    offset = 0.2 + random.normal(0, 1.0, (SIDE, SIDE, 3))
    nothing, most = np.zeros_like(offset), np.full_like(offset, 0.1**2)
    assert bias(offset, nothing).share < 0.5
    # The mean of 64 pixels errs by 1/8, and the limit of the bounded noise is 0.06.
    assert bias(offset, nothing, most).share > 0.8


def test_noise_in_still_pixels_is_found_beside_noisy_ones() -> None:
    """A block of which three in eight pixels may be noisy has no such noise in the others."""
    allowed = np.full((8, 8, 3), 1e-6)
    allowed[:3] = 0.04
    everywhere = np.random.default_rng(6).normal(0, 0.2, (8, 8, 3))
    assert noise(everywhere, allowed, 4).share == 1
    assert noise(np.where(allowed > 1e-3, everywhere, 0.0), allowed, 4).share == 0


@pytest.mark.parametrize(("spots", "share"), [(1, 0), (2, 1)])
def test_two_spots_in_a_block_are_noise(spots: int, share: float) -> None:
    rare = np.zeros((8, 8, 3))
    rare[0, : 2 * spots : 2] = 0.25
    assert noise(rare, np.full(rare.shape, 1e-4), 4).share == share
