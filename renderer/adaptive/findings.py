"""What samples say: errors of the pixels that show them, and of pilot samples where they are probes."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from renderer.adaptive import uncertainty
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.lamps import lit
from renderer.adaptive.lattice import Picture
from renderer.adaptive.levels import COUNTS, SAMPLED
from renderer.adaptive.neighbours import highest
from renderer.adaptive.strata import COUNT, Survey, expected_errors, survey, typical_error
from renderer.adaptive.uncertainty import ErrorEstimate, unseen_glints
from renderer.film import Image
from renderer.halves import HALVES
from renderer.layers import Layers
from renderer.math.arrays import Floats, Integers, Masks, taken

UNMODELLED = 1 / 6
"""Standard error of the sum of squared errors, as a share of it, for what samples have not hit: large errors
are in few pixels. With an eighth 93 % of true errors are in their interval, with a sixth 96 %."""


PRIOR = 16
"""Samples that the mean variance around a pixel counts for beside those of its own. With 8 and with 32 random
pictures keep as many targets, with samples 4 % apart; without it 13 points fewer."""

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


def findings(estimate: Estimate) -> Findings:
    """The statistics of a picture when a pass is complete."""
    return _findings(estimate, estimate.shown, ~estimate.shown)


def so_far(estimate: Estimate) -> Findings:
    """The statistics in the middle of a pass: pixels that wait for samples show their pilot sample.

    All samples of their stratum say how far off that is, even if they are shown.
    """
    waiting = estimate.displayed & (estimate.have < SAMPLED)
    alike = np.zeros(COUNT, dtype=bool)
    alike[estimate.strata[waiting]] = True
    shown = estimate.displayed & ~waiting
    return _findings(estimate, shown, ~shown | alike[estimate.strata])


def keep_pilots(estimate: Estimate, found: Findings) -> Findings:
    """Show pilot samples where those `found` are worse; gives what samples say of the picture then.

    Samples of the same pixels say both: how far they are from each other, and from pilot samples.
    """
    if not estimate.piloted:
        return found
    numbers = estimate.strata.ravel()[found.sampled]
    halves = taken(estimate.halves.reshape(6, -1), found.sampled).reshape(2, 3, -1)
    errors, _ = errors_of(halves, taken(estimate.values.reshape(3, -1), found.sampled))
    own, others = (np.bincount(numbers, values, minlength=COUNT) for values in (found.squares, errors))
    estimate.kept = estimate.shown & (own > np.maximum(others, 0))[estimate.strata]
    return _findings(estimate, estimate.displayed, ~estimate.displayed) if estimate.kept.any() else found


def error_of(estimate: Estimate, found: Findings) -> ErrorEstimate:
    """The error of the picture, with the bound that has to keep the target."""
    unseen = unseen_glints(estimate.labels, estimate.counts, estimate.plan.glints)
    return uncertainty.error_of(found.total, found.variance, estimate.have.size, estimate.confidence, unseen)


def settle(estimate: Estimate) -> None:
    """Find the error of the picture as it is, in the middle of a pass or not.

    Before there are samples nothing is known of it but what the coarse picture lets expect.
    """
    if (estimate.have >= SAMPLED).any():
        estimate.kept[...] = False
        keep_pilots(estimate, so_far(estimate))
        estimate.error = error_of(estimate, so_far(estimate))
    elif estimate.error is None:
        expected = expected_errors(estimate.image().transpose(2, 0, 1)).mean(dtype=np.float64)
        estimate.error = ErrorEstimate(float(np.sqrt(expected)), 0.0, 1.0, 1.0)


def sample_layers(estimate: Estimate, names: Iterable[str]) -> Layers:
    """Those layers of a request that describe samples."""
    asked, found = set(names), Layers()
    if "samples" in asked:
        found["samples"] = estimate.counts().astype(np.int32)
    if "error" in asked:
        found["error"] = _errors(estimate)
    return found


def _errors(estimate: Estimate) -> Image:
    """Estimated standard errors of the pixels, (H, W, 3) float32; for pilot samples their stratum's."""
    shown = estimate.displayed
    found = _findings(estimate, shown, ~shown)
    pilots = np.sqrt(np.maximum(found.survey.errors, 0))[estimate.strata]
    halves = np.abs(estimate.halves[0] - estimate.halves[1]) / 2
    squares = np.where(shown, halves, pilots) ** 2 + estimate.spread
    return np.sqrt(squares).transpose(1, 2, 0).astype(np.float32)


def _findings(estimate: Estimate, shown: Masks, probing: Masks) -> Findings:
    """The statistics of a picture that shows the samples of some pixels (H, W).

    Samples of those that are `probing` (H, W) measure pilot samples that are shown.
    """
    levels, strata = estimate.have.ravel(), estimate.strata.ravel()
    sampled = np.flatnonzero(shown.ravel() & (levels >= SAMPLED))
    probes = np.flatnonzero(probing.ravel() & (levels >= SAMPLED))
    means = estimate.halves.reshape(HALVES, 3, -1)
    single = np.zeros(levels.size)
    for chosen in (sampled, probes):
        single[chosen] = estimate.squares.ravel()[chosen] / (COUNTS[levels[chosen]] - 1)
    lights = lit(estimate.labels, estimate.plan.lamps)
    squared, variances = _sampled(
        means[:, :, sampled], single, sampled, COUNTS[levels[sampled]], estimate.values, lights
    )
    errors, noise = errors_of(means[:, :, probes], estimate.values.reshape(3, -1)[:, probes])
    return Findings(
        sampled=sampled,
        probes=probes,
        squares=squared,
        variances=variances,
        errors=errors,
        noise=noise,
        spread=estimate.spread[estimate.spread > 0].astype(np.float64),
        survey=survey(
            strata=strata[probes],
            sizes=np.bincount(strata[~shown.ravel()], minlength=COUNT),
            errors=errors,
            spread=noise,
            variances=single[probes],
            expected=typical_error(strata[probes]),
        ),
    )


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
    model = scale * (taken * own + PRIOR * around) / (taken + PRIOR)
    return model * shares, model


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
