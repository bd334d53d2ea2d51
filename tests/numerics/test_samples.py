"""Samples: sums of a million, variances of nearly equal ones, and tiles that change no random number."""

import math
from fractions import Fraction
from functools import reduce
from typing import Any

import numpy as np
import pytest

from renderer.film import Film, compose
from renderer.layers import Spread, merged, standard_errors
from renderer.math.numerics import halving_sum
from renderer.tiling import passes
from schemas.tiles import Tile

Floats = np.ndarray


def brightnesses(count: int, seed: int) -> Floats:
    """Samples (3, count): all the same, at random, and one bright one before many dark ones."""
    drawn = np.random.default_rng(seed)
    last = np.full(count, drawn.random() / 1000)
    last[0] = 1e6
    return np.array([np.full(count, drawn.integers(1, 10) / 10), drawn.random(count), last])


def test_sum_of_a_million_has_12_digits() -> None:
    samples = brightnesses(1_000_000, seed=0)
    true = np.array([math.fsum(row) for row in samples])
    assert np.abs(halving_sum(samples.T.copy()) / true - 1).max() <= 1e-12


def of_one_pixel(make: Any, samples: Floats) -> list[Any]:
    """Sums of each pass over one pixel's samples (3, N)."""
    zero, kept = np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, samples.shape[1])[1:]:
        part = make(Tile(0, 0, 0, 1, 1), pass_)
        part.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        kept.append((pass_, part))
    return kept


@pytest.mark.parametrize("count", [1, 4, 5, 63, 64, 100, 1000, 4096])
def test_pixel_is_the_mean_of_its_samples(count: int) -> None:
    samples = brightnesses(count, seed=count)
    image = compose([(pass_, film.image()) for pass_, film in of_one_pixel(Film, samples)])
    true = np.array([math.fsum(row) / count for row in samples])
    assert np.abs(image[0, 0] / true - 1).max() <= 2.0**-23


def errors_of(samples: Floats) -> Floats:
    """Standard errors (3,) of the mean, of one pixel, as the renderer estimates them."""
    records = [part.record for _, part in of_one_pixel(Spread, samples)]
    return standard_errors(reduce(merged, records))[0, 0].astype(np.float64)


@pytest.mark.parametrize("count", [2, 4, 16, 50, 200])
def test_variance_of_nearly_equal_samples_is_exact(count: int) -> None:
    """About 1, a thousand and a million with a deviation of 1/100, against rational numbers."""
    drawn = np.random.default_rng(count).normal(scale=0.01, size=(3, count))
    samples = np.array([[1.0], [1e3], [1e6]]) + drawn
    true = []
    for row in samples.tolist():
        values = [Fraction(x) for x in row]
        mean = sum(values, Fraction(0)) / count
        true.append(math.sqrt(sum((x - mean) ** 2 for x in values) / (count - 1) / count))
    assert np.abs(errors_of(samples) / true - 1).max() <= 2.0**-23


def test_variance_of_equal_samples_is_zero() -> None:
    assert not errors_of(np.repeat([[0.1], [1e3], [1e30]], 100, axis=1)).any()
