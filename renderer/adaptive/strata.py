"""Strata of pixels by the expected error of their pilot sample, and the error that probes measure in each.

A stratum is a kind of pixel and 1.5 octaves of its expected squared error. Some of its pixels, chosen by a
hash of their number, are sampled as probes. With the halves a and b of a probe and the pilot sample v, the
mean of (a - v)(b - v) is the squared error of v without bias, because the halves are independent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.lattice import Picture
from renderer.math.arrays import Floats, Integers, Masks
from renderer.math.streams import bits, keys, uniforms

STEPS_PER_KIND = 24
"""Strata of each kind: 1.5 octaves of the squared error each, from below 1e-10 to 1."""

INTERPOLATED, EVEN, BORDER, NEEDS_SAMPLING, OUTLIER = range(5)
"""Kinds: interpolated; away from borders; at borders; with fine detail; where pilot samples may miss
light."""

UNSEEN_ERROR_FACTOR = 16.0
"""Error that the next probe may find, over the expected one: few probes miss rare errors."""

MAX_PIXEL_BUDGET_SHARE = 2.0**-8
"""Share of the budget that one pixel may be expected to use; beyond it its whole stratum is probed."""

MIN_PROBES, PROBES_PER_BUDGET = 16, 50
"""Least probes of a stratum, and further ones if it is expected to use the whole budget."""

COUNT = STEPS_PER_KIND * (OUTLIER + 1)
"""Number of strata."""

PROBE_STREAM = 1 << 41
"""Random number stream that chooses probes, distinct from those of lights and lens."""


def expected_errors(values: Picture) -> NDArray[np.float32]:
    """Expected squared error of the pilot sample of each pixel, (H, W), mean over channels.

    A step of height h between two pilot samples appears as a second difference h, and their mean squared
    error is h * h / 12.
    """
    clipped = np.clip(values, 0, 1)
    across = _squares(np.diff(clipped, n=2, axis=2))
    along = _squares(np.diff(clipped, n=2, axis=1))
    found = np.maximum(
        np.pad(across, ((0, 0), (1, 1)), mode="edge") if across.size else 0,
        np.pad(along, ((1, 1), (0, 0)), mode="edge") if along.size else 0,
    )
    return np.broadcast_to(found / np.float32(36), values.shape[1:]).astype(np.float32)


def _squares(differences: Picture) -> NDArray[np.float32]:
    return np.multiply(differences, differences, out=differences).sum(axis=0)


def strata_of(expected: NDArray[np.float32], kinds: Integers) -> Integers:
    """Stratum of each pixel, (H, W), from its expected error and its kind."""
    steps = (np.log2(np.maximum(expected, 1e-12)) + 36) * np.float32(2 / 3)
    return np.clip(steps, 0, STEPS_PER_KIND - 1).astype(np.int64) + STEPS_PER_KIND * kinds


def typical_error(strata: Integers) -> Floats:
    """Largest expected error of strata (n,)."""
    return np.exp2((strata % STEPS_PER_KIND + 1) * 1.5 - 36)


def probe_probability(strata: Integers, expected: NDArray[np.float32], share: float, budget: float) -> Floats:
    """Share (COUNT,) of the pixels of each stratum that are probed.

    It grows with the share of the `budget` that is expected of a stratum, and of one of its pixels, as the
    whole error of many may be that of a few.
    """
    alone = typical_error(np.arange(COUNT)) / (MAX_PIXEL_BUDGET_SHARE * budget)
    sizes = np.bincount(strata.ravel(), minlength=COUNT)
    errors = np.bincount(strata.ravel(), expected.ravel(), minlength=COUNT)
    probes = share * sizes + MIN_PROBES + PROBES_PER_BUDGET * errors / budget
    return np.minimum(probes / np.maximum(sizes, 1) + alone, 1.0)


def probe_ranks(seed: int, shape: tuple[int, int]) -> Floats:
    """Hash in [0, 1) of each pixel (H, W): a probe where it is below the stratum's probability."""
    numbers = np.arange(shape[0] * shape[1], dtype=np.int64)
    return uniforms(bits(keys(seed, PROBE_STREAM, numbers), 0)).reshape(shape)


@dataclass(frozen=True, slots=True, eq=False)
class StratumStatistics:
    """Errors that probes measure in each stratum; all (COUNT,).

    Attributes
    ----------
    sizes : int64
        Pixels that show their pilot sample, probes included.
    errors, uncertain : float64
        Mean squared error of a pilot sample, and its standard error.
    noise : float64
        Part of `uncertain` that more samples of the same probes would remove.
    variances : float64
        Of a single camera sample, mean over channels; a pilot sample is one, where there are no probes.
    """

    sizes: Integers
    errors: Floats
    uncertain: Floats
    noise: Floats
    variances: Floats

    @property
    def total(self) -> float:
        """Sum of the squared errors of all pixels that show pilot samples."""
        return float((self.sizes * self.errors).sum())

    @property
    def variance(self) -> float:
        """Of `total`."""
        return float(((self.sizes * self.uncertain) ** 2).sum())

    def unsure(self, allowed: float) -> Masks:
        """Strata with the largest variances, so that those of all others add up to at most `allowed`."""
        variances = (self.sizes * self.uncertain) ** 2
        order = np.argsort(variances, kind="stable")
        unsure = np.zeros(variances.size, dtype=bool)
        unsure[order] = np.cumsum(variances[order]) > allowed
        return unsure


def stratum_statistics(
    strata: Integers,
    sizes: Integers,
    errors: Floats,
    noise: Floats,
    variances: Floats,
) -> StratumStatistics:
    """Error of each stratum from probes (n,).

    Parameters
    ----------
    strata : (n,) int64
    sizes : (COUNT,) int64
    errors : (n,) float64
        (a - v)(b - v) of each probe.
    noise : (n,) float64
        Variance of `errors`, from the difference of the halves.
    variances : (n,) float64
    """
    found = np.bincount(strata, minlength=COUNT)
    counts = np.maximum(found, 1)

    def mean(values: Floats) -> Floats:
        return np.bincount(strata, values, minlength=COUNT) / counts

    typical = typical_error(np.arange(COUNT))
    unknown = (found == 0) & (sizes > 0)
    unseen = UNSEEN_ERROR_FACTOR * mean(typical[strata]) / counts
    return StratumStatistics(
        sizes=sizes,
        errors=np.where(unknown, typical, np.maximum(mean(errors), 0)),
        uncertain=np.where(unknown, typical, np.sqrt(mean(errors * errors) / counts + unseen**2)),
        noise=np.sqrt(mean(noise) / counts),
        variances=np.where(unknown, typical, mean(variances)),
    )
