"""What samples say: errors of the pixels that show them, and of pilot samples where they are probes."""

from dataclasses import dataclass

import numpy as np

from renderer.adaptive.lattice import Picture
from renderer.adaptive.levels import COUNTS, SAMPLED, Levels
from renderer.adaptive.neighbours import highest
from renderer.adaptive.strata import COUNT, Survey, survey, typical_error
from renderer.math.arrays import Floats, Integers, Masks

UNMODELLED = 1 / 8
"""Standard error of the sum of squared errors, as a share of it, for what samples have not hit: large errors
are in few pixels."""


GLARE = 1 / 4
"""Probability that a pixel beside one brighter than white shows part of the same source. A lamp 225 times as
bright as white that covers 1 % of a pixel makes it white, and 8 samples miss it in 9 of 10 pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """Numbers about the n sampled pixels that show their samples, and the m probes that show a pilot sample.

    Attributes
    ----------
    sampled, probes : (n,) and (m,) int64
        Numbers of the pixels.
    squares : (n,) float64
        Squared standard errors, mean over channels: a quarter of the squared difference of the halves, and
        what the variances around let expect.
    variances : (n,) float64
        Of single samples, such that they times the number of samples to the power -1.5 add up to `squares`.
    errors : (m,) float64
        Squared errors of pilot samples, without bias.
    noise : (m,) float64
        Variances of `errors`, from the difference of the halves.
    survey : Survey
        What the probes say of each stratum.
    spread : (k,) float64
        Squared standard errors of what pixels at borders show, because of shares; beside all others.
    """

    sampled: Integers
    probes: Integers
    squares: Floats
    variances: Floats
    errors: Floats
    noise: Floats
    survey: Survey
    spread: Floats

    @property
    def total(self) -> float:
        """Sum of the squared errors of all pixels."""
        return float(self.squares.sum()) + float(self.spread.sum()) + self.survey.total

    @property
    def variance(self) -> float:
        """Of `total`: a squared difference of two numbers has twice its own square."""
        own = float((self.squares**2).sum()) + float((self.spread**2).sum())
        return 2 * own + self.survey.variance + (UNMODELLED * self.total) ** 2


def findings_of(  # noqa: PLR0913, PLR0917  arrays of an estimate
    halves: Floats,
    squares: Floats,
    have: Levels,
    shown: Masks,
    probing: Masks,
    pilots: Picture,
    strata: Integers,
    spread: Picture,
    lit: Masks,
) -> Findings:
    """What is known of a picture; arrays as in `estimate.Estimate`, `pilots` its values.

    Samples of the pixels `probing` (H, W) are probes: they measure pilot samples that are shown. Pixels that
    are `lit` (H, W) show a light that the camera sees, whose share of pixels is known.
    """
    levels = have.ravel()
    sampled = np.flatnonzero(shown.ravel() & (levels >= SAMPLED))
    probes = np.flatnonzero(probing.ravel() & (levels >= SAMPLED))
    means = halves.reshape(2, 3, -1)
    single = np.zeros(levels.size)
    for chosen in (sampled, probes):
        single[chosen] = squares.ravel()[chosen] / (COUNTS[levels[chosen]] - 1)
    squared, variances = _sampled(means[:, :, sampled], single, sampled, COUNTS[levels[sampled]], pilots, lit)
    errors, noise = errors_of(means[:, :, probes], pilots.reshape(3, -1)[:, probes])
    numbers = strata.ravel()
    return Findings(
        sampled=sampled,
        probes=probes,
        squares=squared,
        variances=variances,
        errors=errors,
        noise=noise,
        spread=spread[spread > 0].astype(np.float64),
        survey=survey(
            strata=numbers[probes],
            sizes=np.bincount(numbers[~shown.ravel()], minlength=COUNT),
            errors=errors,
            spread=noise,
            variances=single[probes],
            expected=typical_error(numbers[probes]),
        ),
    )


def worse_than_pilots(found: Findings, halves: Floats, pilots: Picture, strata: Integers) -> Masks:
    """Strata (COUNT,) whose samples are expected to err by more than the pilot samples that they replace.

    Samples of the same pixels (2, 3, H, W) say both: how far they are from each other, and from those.
    """
    numbers = strata.ravel()[found.sampled]
    errors, _ = errors_of(
        halves.reshape(2, 3, -1)[:, :, found.sampled], pilots.reshape(3, -1)[:, found.sampled]
    )
    own, others = (np.bincount(numbers, values, minlength=COUNT) for values in (found.squares, errors))
    return np.asarray(own > np.maximum(others, 0))


def _sampled(
    halves: Floats, single: Floats, sampled: Integers, counts: Integers, pilots: Picture, lit: Masks
) -> tuple[Floats, Floats]:
    """Squared errors and variances (n,) of sampled pixels, from their halves (2, 3, n).

    `single` holds variances of samples of the whole picture; of what is brighter than white it becomes 0.
    The variances are scaled to explain the squared errors: each at least that of its neighbours, together
    they would let allocation expect 1.4 to 1.5 times the error, and ask for too many samples.
    """
    missed = _missed_glare(halves.mean(axis=0), single, sampled, counts, pilots, lit)
    bright = (halves > 1).all(axis=(0, 1))
    single[sampled[bright]] = 0.0
    squares, variances = _guarded(
        single.reshape(pilots.shape[1:]), sampled, _differences(np.clip(halves, 0, 1)), counts
    )
    squares[bright] = 0.0
    squares += missed
    shares = counts**-1.5
    variances = np.maximum(variances, missed / shares)
    explained = float((variances * shares).sum())
    return squares, variances * (float(squares.sum()) / explained if explained > 0 else 0.0)


def errors_of(halves: Floats, pilots: Picture) -> tuple[Floats, Floats]:
    """Squared errors (n,) of pilot samples (3, n), unbiased, and their variances, from halves (2, 3, n)."""
    both = np.clip(halves, 0, 1)
    a, b = both - np.clip(pilots, 0, 1)
    errors, spread = (a * b).mean(axis=0), 2 * _differences(both)
    return errors, spread * (2 * np.maximum(errors, 0) + spread)


def _differences(halves: Floats) -> Floats:
    """Squared standard errors of the means of two halves (2, 3, n), mean over channels."""
    return ((halves[0] - halves[1]) ** 2).mean(axis=0) / 4


def _guarded(single: Floats, sampled: Integers, squares: Floats, taken: Integers) -> tuple[Floats, Floats]:
    """Squared errors and variances of the sampled pixels (n,), none far below its neighbours'.

    Few samples may all fall on one side of an edge: the neighbours show that there is one. Pixels whose
    samples find an edge get more of them, and those that missed it do not, so that their own differences
    alone would say too little.
    """
    known, inside = np.zeros((2, *single.shape))
    known.ravel()[sampled] = 1.0
    own = inside.ravel()[sampled] = single.ravel()[sampled]
    around = _sums(inside, sampled) / _sums(known, sampled)
    shares = taken**-1.5
    explained = float((own * shares).sum())
    if explained == 0:
        return squares, np.zeros(own.size)
    scale = float(squares.sum()) / explained
    return (squares + scale * around * shares) / 2, scale * np.maximum(own, around)


def _missed_glare(
    means: Floats, single: Floats, sampled: Integers, counts: Integers, pilots: Picture, lit: Masks
) -> Floats:
    """Squared errors (n,) to expect of sampled pixels beside something brighter than white.

    It whitens a pixel from a share of one over its brightness on, which `counts` (n,) samples miss with a
    probability of exp(-count / brightness). A few samples of brightness b among dark ones have a mean m and
    a variance of m (b - m).
    """
    values = np.maximum(means, pilots.reshape(3, -1)[:, sampled])
    white = (values.min(axis=0) > 1) & ~lit.ravel()[sampled]
    if not white.any():
        return np.zeros(sampled.size)
    glare = np.zeros(pilots.shape[1:], dtype=np.float32)
    mean = values[:, white].mean(axis=0)
    glare.ravel()[sampled[white]] = mean + single[sampled[white]] / mean
    brightness = highest(glare, 1).ravel()[sampled]
    missed = np.exp(-counts / np.maximum(brightness, 1.0)) * (brightness > 0)
    return GLARE * missed * (np.clip(1 - means, 0, 1) ** 2).mean(axis=0)


def _sums(values: Floats, chosen: Integers) -> Floats:
    """Sums over chosen pixels (n,) of a picture (H, W), and the eight neighbours of each.

    Sampled pixels are few in most pictures: sums over all would be a third of the work between passes.
    """
    padded = np.pad(values, 1)
    flat, width = padded.ravel(), padded.shape[1]
    corner = chosen + 2 * (chosen // values.shape[1])

    def row(start: Integers) -> Floats:
        return flat[start] + flat[start + width] + flat[start + 2 * width]

    return row(corner) + row(corner + 1) + row(corner + 2)
