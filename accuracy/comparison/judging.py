"""The verdict on two pictures: tolerances, and the deciding test."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from accuracy.comparison.blocks import Bias
from accuracy.comparison.noise import Noise
from accuracy.comparison.variances import Scores

Verdict = Literal["match", "noisy_match", "mismatch"]
Deciding = Literal["rounding", "blocks", "block", "noise", "variances", "diagnosis"]


@dataclass(frozen=True, slots=True)
class Policy:
    """Tolerances of a comparison.

    Attributes
    ----------
    tolerance : float
        Mean difference of a block, linear, that is always tolerated. Fixed patterns have errors other than
        noise, which are larger the fewer points a light has. With random patterns it may be 0.
    most_bias : float
        Share of biased blocks above which pictures differ if their noise is not known.
    limit : float
        Of the metric `frac_over`, linear.
    single : bool
        Whether a single block that is far off makes a mismatch.
    samples : int or None
        Fewest random samples in a pixel: if the reference states its noise, more than theirs counts as a
        difference. None accepts any noise.
    """

    tolerance: float = 0.01
    most_bias: float = 0.02
    limit: float = 0.05
    single: bool = True
    samples: int | None = None


@dataclass(frozen=True, slots=True)
class Judgement:
    """A verdict with its reasons.

    Attributes
    ----------
    verdict : {"match", "noisy_match", "mismatch"}
    reason : str
        The reason, a sentence.
    test : {"rounding", "blocks", "block", "noise", "variances", "diagnosis"}
        The test that decided.
    margin : float or None
        Distance of the deciding number from its limit, as a share of the limit; below 0 for a mismatch. None
        if no number decided.
    samples_factor : float or None
        Factor of samples in both pictures with which the same difference would be significant; below 1 if it
        is now. None if nothing differs, or noise or a single block decided.
    """

    verdict: Verdict
    reason: str
    test: Deciding
    margin: float | None
    samples_factor: float | None


def judge(
    *,
    equal: bool,
    bias: Bias,
    scores: Scores | None,
    explained: bool,
    policy: Policy,
    noise: Noise | None = None,
) -> Judgement:
    """The verdict on two pictures.

    Parameters
    ----------
    equal
        Whether they differ by at most rounding.
    scores
        Of the noise that both pictures state; it decides in place of `bias` where it is known.
    explained
        Undoing one mistake makes the pictures agree.
    noise
        Noise of the blocks; None if any noise is allowed.
    """
    if equal:
        return Judgement("match", "No pixel differs by more than rounding.", "rounding", None, None)
    found = _by_blocks(bias, noise, policy) if scores is None else _by_variances(scores)
    # A mistake says more than the noise that it looks like.
    if not explained or (found.verdict == "mismatch" and found.test != "noise"):
        return found
    reason = "Undoing one mistake makes the pictures agree."
    return Judgement("mismatch", reason, "diagnosis", None, found.samples_factor)


def _by_variances(scores: Scores) -> Judgement:
    verdict: Verdict = "mismatch" if scores.differs else "noisy_match"
    factor = None if scores.largest == 0 else (scores.limit / scores.largest) ** 2
    more = "more" if scores.differs else "no more"
    reason = (
        f"The block that differs most is off by {scores.largest:.3g} standard errors, {more} than the "
        f"{scores.limit:.3g} that noise reaches in one of 1000 pairs of pictures."
    )
    return Judgement(verdict, reason, "variances", _margin(scores.largest, scores.limit), factor)


def _by_blocks(bias: Bias, noise: Noise | None, policy: Policy) -> Judgement:
    factor = _factor(bias, policy)
    # Where noise is bounded, too much of it makes blocks biased: the larger share says what is wrong.
    if noise is not None and noise.share > max(bias.share, policy.most_bias):
        return Judgement("mismatch", *_noisy(noise, policy), None)
    if bias.share > policy.most_bias:
        return Judgement("mismatch", *_biased(bias, policy), factor)
    if policy.single and bias.beyond_doubt(policy.tolerance).any():
        return Judgement("mismatch", _single(bias, policy), "block", None, None)
    return Judgement("noisy_match", *_biased(bias, policy), factor)


def _biased(bias: Bias, policy: Policy) -> tuple[str, Deciding, float | None]:
    reason = (
        f"{100 * bias.share:.1f} % of the blocks are brighter or darker than noise explains, by more than "
        f"{policy.tolerance:g}. Up to {100 * policy.most_bias:.0f} % are allowed."
    )
    return reason, "blocks", _margin(bias.share, policy.most_bias)


def _noisy(noise: Noise, policy: Policy) -> tuple[str, Deciding, float | None]:
    samples = "1 sample" if noise.samples == 1 else f"{noise.samples} samples"
    reason = (
        f"The picture is noisier than {samples} a pixel: {100 * noise.share:.1f} % of the blocks have more "
        f"noise than so many random samples leave. Up to {100 * policy.most_bias:.0f} % are allowed."
    )
    return reason, "noise", _margin(noise.share, policy.most_bias)


def _single(bias: Bias, policy: Policy) -> str:
    certain = bias.beyond_doubt(policy.tolerance)
    count = np.count_nonzero(certain)
    blocks = "One block of 8 x 8 pixels is" if count == 1 else f"{count} blocks of 8 x 8 pixels are"
    return (
        f"{blocks} off by up to {bias.excess[certain].max():.2g} more than is tolerated. Noise does this in "
        "one of a million pictures."
    )


def _margin(found: float, limit: float) -> float | None:
    """Distance of a number below its limit, as a share of the limit; None if it is not a number."""
    return 1 - found / limit if limit > 0 and math.isfinite(found) else None


def _factor(bias: Bias, policy: Policy) -> float | None:
    """Factor of samples with which more than the limit's share of blocks would be biased.

    None if too few blocks differ by more than the tolerance. The ratio of a real
    difference to its noise grows with the root of the samples.
    """
    place = min(int(policy.most_bias * bias.ratios.size), bias.ratios.size - 1)
    last = np.sort(bias.ratios, axis=None)[::-1][place]
    if last == 0:
        return None
    return 0.0 if math.isinf(last) else float(last) ** -2
