"""Strata of pixels by the expected error of their pilot sample, and what probes measure in each stratum.

A stratum is a kind of pixel and an octave or so of its expected error. Of each some pixels, chosen by a hash
of their number, are sampled as probes. From the halves a and b of a probe and the pilot sample v the mean of
(a - v)(b - v) is the squared error of v, without bias, because the halves are independent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.lattice import Picture
from renderer.math.arrays import Floats, Integers, Masks
from renderer.math.streams import bits, keys, uniforms

STEPS = 24
"""Strata of each kind: 1.5 octaves of the squared error each, from below 1e-10 to 1."""

INTERPOLATED, EVEN, BORDER, NEEDS_SAMPLING, SUSPECT = range(5)
"""Kinds: without a pilot sample; away from other shapes; beside one; with something fine; near a find."""

UNSEEN = 16.0
"""The next probe may find this many times the expected error: a few probes miss what is rare."""

ALONE = 2.0**-8
"""If one pixel is expected to use this share of the budget, all pixels of its stratum are probes."""

PROBES_AT_LEAST, PROBES_OF_BUDGET = 16, 50
"""Least number of probes of a stratum, and of one that is expected to use the whole budget."""

COUNT = STEPS * (SUSPECT + 1)
"""Number of strata."""

PROBES = 1 << 41
"""Stream of random numbers for the choice of probes, apart from those of lights and lens."""


def expected_errors(values: Picture) -> NDArray[np.float32]:
    """Squared error, mean over channels, to expect of a pilot sample of each pixel, (H, W).

    A step of height h somewhere between two pilot samples shows as a second difference h; one errs by
    h * h / 12 in the mean.
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
    return np.clip(steps, 0, STEPS - 1).astype(np.int64) + STEPS * kinds


def typical_error(strata: Integers) -> Floats:
    """Largest expected error of strata (n,)."""
    return np.exp2((strata % STEPS + 1) * 1.5 - 36)


def probe_probability(strata: Integers, expected: NDArray[np.float32], share: float, budget: float) -> Floats:
    """Share (COUNT,) of the pixels of each stratum that are probed.

    At least some everywhere, and more where more of the `budget` of squared errors is expected: of a stratum,
    and of one of its pixels, as few may err by all that is expected of many.
    """
    alone = typical_error(np.arange(COUNT)) / (ALONE * budget)
    sizes = np.bincount(strata.ravel(), minlength=COUNT)
    errors = np.bincount(strata.ravel(), expected.ravel(), minlength=COUNT)
    probes = share * sizes + PROBES_AT_LEAST + PROBES_OF_BUDGET * errors / budget
    return np.minimum(probes / np.maximum(sizes, 1) + alone, 1.0)


def probe_ranks(seed: int, shape: tuple[int, int]) -> Floats:
    """A number in [0, 1) for each pixel (H, W): a probe where it is below the stratum's probability."""
    numbers = np.arange(shape[0] * shape[1], dtype=np.int64)
    return uniforms(bits(keys(seed, PROBES, numbers), 0)).reshape(shape)


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What probes measure in each stratum; all (COUNT,).

    Attributes
    ----------
    sizes : int64
        Pixels whose pilot sample is shown, probes among them.
    errors, uncertain : float64
        Mean squared error of a pilot sample, and the standard error of that.
    noise : float64
        Part of `uncertain` that more samples of the same probes would take away.
    variances : float64
        Of a single camera sample, mean over channels.
    """

    sizes: Integers
    errors: Floats
    uncertain: Floats
    noise: Floats
    variances: Floats

    @property
    def total(self) -> float:
        """Sum of the squared errors of all pilot samples that are shown."""
        return float((self.sizes * self.errors).sum())

    @property
    def variance(self) -> float:
        """Of `total`."""
        return float(((self.sizes * self.uncertain) ** 2).sum())

    def unsure(self, allowed: float) -> Masks:
        """The strata of the largest variances, so that those of all others add up to what is allowed."""
        variances = (self.sizes * self.uncertain) ** 2
        order = np.argsort(variances, kind="stable")
        unsure = np.zeros(variances.size, dtype=bool)
        unsure[order] = np.cumsum(variances[order]) > allowed
        return unsure


def survey(
    strata: Integers,
    sizes: Integers,
    errors: Floats,
    spread: Floats,
    variances: Floats,
    expected: Floats,
) -> Survey:
    """What probes (n,) measure.

    Parameters
    ----------
    strata : (n,) int64
    sizes : (COUNT,) int64
    errors : (n,) float64
        (a - v)(b - v) of each probe.
    spread : (n,) float64
        Its squared standard error, from the difference of its halves.
    variances : (n,) float64
    expected : (n,) float64
        Squared errors that were expected.
    """
    counts = np.maximum(np.bincount(strata, minlength=COUNT), 1)

    def mean(values: Floats) -> Floats:
        return np.bincount(strata, values, minlength=COUNT) / counts

    typical = typical_error(np.arange(COUNT))
    unknown = (np.bincount(strata, minlength=COUNT) == 0) & (sizes > 0)
    unseen = UNSEEN * mean(expected) / counts
    return Survey(
        sizes=sizes,
        errors=np.where(unknown, typical, np.maximum(mean(errors), 0)),
        uncertain=np.where(unknown, typical, np.sqrt(mean(errors * errors) / counts + unseen**2)),
        noise=np.sqrt(mean(spread) / counts),
        variances=mean(variances),
    )
