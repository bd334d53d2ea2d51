"""Error rates of the verdict, on pictures whose truth is known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from accuracy.comparison import Comparison, Picture, Policy, compare
from accuracy.comparison.blocks import bias

SIDE = 64
STRICT = Policy(tolerance=0.0)


def truth() -> np.ndarray:
    """Smooth grey between 0.2 and 0.8, so that no noise below is clipped."""
    across = np.linspace(0, np.pi, SIDE)
    plane = 0.5 + 0.3 * np.sin(across)[None, :] * np.cos(across)[:, None]
    return plane[:, :, None] * np.ones(3)


def noisy(mean: np.ndarray, random: np.random.Generator, samples: int = 16) -> Picture:
    """The mean of so many samples with a deviation of 0.1 in each pixel, with its estimated error."""
    drawn = mean + 0.1 * random.uniform(-np.sqrt(3), np.sqrt(3), (samples, *mean.shape))
    pixels = np.clip(drawn.mean(axis=0), 0, 1)
    error = drawn.std(axis=0, ddof=1) / np.sqrt(samples)
    layers: dict[str, Any] = {"error": error, "samples": np.full(mean.shape[:2], samples)}
    return replace(Picture.of_values(pixels, np.zeros_like(pixels)), layers=layers)


def without_errors(picture: Picture) -> Picture:
    return replace(picture, layers={})


def pair(image: np.ndarray, seed: int) -> Comparison:
    random = np.random.default_rng(seed)
    return compare(noisy(image, random), noisy(truth(), random), policy=STRICT)


def test_noise_makes_blocks_biased_as_often_as_stated() -> None:
    """6,400 blocks of differences; such a binomial strays by 4.5 deviations once in 150,000."""
    difference = np.random.default_rng(11).standard_normal((640, 640, 3))
    count = 6400 * bias(difference, np.zeros_like(difference)).share
    expected = 6400 * 0.001
    assert abs(count - expected) < 4.5 * np.sqrt(expected * (1 - 0.001))


@pytest.mark.parametrize(("pairs", "most"), [(40, 2), pytest.param(200, 4, marks=pytest.mark.slow)])
def test_equal_scenes_are_the_same_by_their_variances(pairs: int, most: int) -> None:
    """One false alarm in a thousand pairs: more than these come once in 100,000 trials."""
    assert sum(not pair(truth(), seed).passed for seed in range(pairs)) <= most


@pytest.mark.parametrize(("pairs", "most"), [(20, 2), pytest.param(60, 4, marks=pytest.mark.slow)])
def test_equal_scenes_are_the_same_by_their_blocks(pairs: int, most: int) -> None:
    """Two of 64 blocks must be biased, each with 1/1000: 1 in 500 pairs; more come once in 100,000 trials."""
    alarms = 0
    for seed in range(pairs):
        random = np.random.default_rng(1000 + seed)
        image, reference = (without_errors(noisy(truth(), random)) for _ in range(2))
        alarms += not compare(image, reference, policy=STRICT).passed
    assert alarms <= most


@pytest.mark.parametrize("lit", [True, False])
def test_bias_of_eight_standard_errors_is_found(lit: bool) -> None:
    # The mean of 64 pixels with 0.025, and as much in the reference, errs by 0.0044; the limit is 4.2 errors.
    changed = truth()
    changed[8:16, 8:16] += 8 * 0.0044 * (1 if lit else -1)
    assert all(pair(changed, seed).judgement.verdict == "mismatch" for seed in range(8))


def test_factor_of_samples_settles_variances() -> None:
    """The same difference counts as real where the noise is that of more samples than the factor needs."""
    random = np.random.default_rng(8)
    pictures = noisy(truth(), random), noisy(truth(), random)
    factor = compare(*pictures, policy=STRICT).judgement.samples_factor
    assert factor is not None
    assert factor > 1
    for share, verdict in ((0.9, "noisy_match"), (1.1, "mismatch")):
        surer = [with_less_noise(picture, share * factor) for picture in pictures]
        assert compare(*surer, policy=STRICT).judgement.verdict == verdict


def with_less_noise(picture: Picture, factor: float) -> Picture:
    """The same pixels with the errors of so many times the samples."""
    error = picture.layers["error"] / np.sqrt(factor)
    return replace(picture, layers={**picture.layers, "error": error})
