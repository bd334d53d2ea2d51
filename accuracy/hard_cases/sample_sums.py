"""Hard cases: what the samples of a pixel add up to."""

import math
from fractions import Fraction
from functools import reduce

import numpy as np

from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.sample_places import SECTION
from renderer.film import Film, compose
from renderer.layers.spread import Spread, merged, standard_errors
from renderer.math.arrays import Floats
from renderer.math.numerics import halving_sum
from renderer.tiling import passes
from schemas.tiles import Tile

__all__ = ["SECTION"]

MILLION = 1_000_000


def brightnesses(count: int, seed: int) -> Floats:
    """Samples (3, count): all the same, at random, and one bright one before many dark ones."""
    drawn = np.random.default_rng(seed)
    last = np.full(count, drawn.random() / 1000)
    last[0] = 1e6
    return np.array([np.full(count, drawn.integers(1, 10) / 10), drawn.random(count), last])


def in_order(samples: Floats, dtype: type[np.floating]) -> Floats:
    """Sums (3,) of samples one after the other."""
    return np.cumsum(samples.astype(dtype), axis=1)[:, -1].astype(np.float64)


@SECTION.case(
    "a million samples",
    symptom="Pixels with many samples are too dark, and stay so with more of them.",
    cause="Each addition rounds to the spacing of the sum so far, always the same way for equal samples: a "
    "million times 0.1 is off by 1e-11 in float64 and by 1e-2 in float32.",
    remedy="The samples of a pass are added by halves in float64, the passes by their weights.",
    expected="Sums within 1e-12 of themselves; pixels, rounded to float32 after each pass and at the end, "
    "within 2^-23.",
    source="Higham 2002, Accuracy and stability of numerical algorithms, section 4.2",
)
def million_samples() -> Outcome:
    """Sums of a million, and pixels of up to 4,096 samples through film and passes."""
    counts = (1, 4, 5, 63, 64, 100, 1000, 4096)
    return total([_sums(brightnesses(MILLION, seed=0)), *map(_pixels, counts)])


def _sums(samples: Floats) -> Outcome:
    true = np.array([math.fsum(row) for row in samples])
    plain = [in_order(samples, dtype) for dtype in (np.float64, np.float32)]
    found = (halving_sum(samples.T.copy()), *plain)
    return Outcome(3, *(int(np.count_nonzero(np.abs(sums / true - 1) > 1e-12)) for sums in found))


def _pixels(count: int) -> Outcome:
    samples, zero, parts = brightnesses(count, seed=count), np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, count)[1:]:
        film = Film(Tile(0, 0, 0, 1, 1), pass_)
        film.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        parts.append((pass_, film.image()))
    true = np.array([math.fsum(row) / count for row in samples])
    off = np.abs(compose(parts)[0, 0] / true - 1)
    return Outcome(3, int(np.count_nonzero(off > 2.0**-23)))


def nearly_equal(count: int, seed: int) -> Floats:
    """Samples (3, count) about 1, a thousand and a million with a standard deviation of 1/100."""
    drawn = np.random.default_rng(seed)
    return np.array([[1.0], [1e3], [1e6]]) + drawn.normal(scale=0.01, size=(3, count))


def exact_variance(samples: list[float]) -> float:
    """Mean square of what samples differ from their mean, in rational numbers."""
    exact = [Fraction(x) for x in samples]
    mean = sum(exact, Fraction(0)) / len(exact)
    return float(sum(((x - mean) ** 2 for x in exact), Fraction(0)) / (len(exact) - 1))


def plain_variances(samples: Floats, dtype: type[np.floating]) -> Floats:
    """The mean of the squares less the square of the mean, (3,)."""
    x = samples.astype(dtype)
    count = x.shape[1]
    variances = (x * x).mean(axis=1) - x.mean(axis=1) ** 2
    return variances.astype(np.float64) * count / (count - 1)


@SECTION.case(
    "samples that are nearly equal",
    symptom="Estimated errors that are far too large, or negative and then NaN, in bright and even places.",
    cause="The mean of the squares and the square of the mean share all their digits.",
    remedy="Squares are taken of differences to the mean of a pass, in float64; passes are merged by their "
    "counts, means and squares.",
    expected="Standard errors within 2^-23, the rounding to float32, and never below 0; 0 for equal samples.",
    source="Chan, Golub, LeVeque 1979, Updating formulae and a pairwise algorithm for computing sample "
    "variances",
)
def nearly_equal_samples() -> Outcome:
    """Pixels of 2 to 200 samples, in passes."""
    varied = [_spread(nearly_equal(count, seed=count)) for count in (2, 4, 16, 50, 200)]
    alike = errors_of(np.repeat([[0.1], [1e3], [1e30]], 100, axis=1))
    return total([*varied, Outcome(3, int(np.count_nonzero(alike)))])


def errors_of(samples: Floats) -> Floats:
    """Standard errors (3,) of the mean, of one pixel, as the renderer estimates them."""
    zero, records = np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, samples.shape[1])[1:]:
        part = Spread(Tile(0, 0, 0, 1, 1), pass_)
        part.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        records.append(part.record)
    return standard_errors(reduce(merged, records))[0, 0].astype(np.float64)


def _spread(samples: Floats) -> Outcome:
    count = samples.shape[1]
    true = np.sqrt([exact_variance(row) / count for row in samples.tolist()])
    with np.errstate(invalid="ignore"):
        plain = [np.sqrt(plain_variances(samples, dtype) / count) for dtype in (np.float64, np.float32)]
    found = (errors_of(samples), *plain)
    return Outcome(3, *(int(np.count_nonzero(~(np.abs(e / true - 1) <= 2.0**-23))) for e in found))
