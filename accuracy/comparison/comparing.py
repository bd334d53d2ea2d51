"""Comparing a picture with its reference: metrics, verdict and policy, causes, and regions that differ."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison import variances
from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.decoding import NotComparableError
from accuracy.comparison.diagnosis import Cause, diagnose
from accuracy.comparison.inputs import Picture
from accuracy.comparison.metrics import GUARD, Metrics, flip, luma, metrics, ssim
from accuracy.comparison.regions import Region, named, worst
from accuracy.comparison.variances import Scores
from renderer.math.arrays import Floats, Masks

Verdict = Literal["match", "noisy_match", "mismatch"]


@dataclass(frozen=True, slots=True)
class Policy:
    """What is taken for the same.

    Attributes
    ----------
    tolerance : float
        Mean difference of a block, linear, that is never a reason. Fixed patterns leave errors that are no
        noise, the more the fewer points a light has. With random patterns it may be 0.
    most_bias : float
        Share of biased blocks above which pictures differ, where their noise is not known.
    limit : float
        Of the metric `frac_over`, linear.
    """

    tolerance: float = 0.01
    most_bias: float = 0.02
    limit: float = 0.05


@dataclass(frozen=True, slots=True)
class Judgement:
    """A verdict with its reasons.

    Attributes
    ----------
    verdict : {"match", "noisy_match", "mismatch"}
    reason : str
        What decided, a sentence.
    test : {"rounding", "blocks", "variances", "diagnosis"}
        Which test decided.
    margin : float or None
        How far the deciding number is from its limit, as a share of the limit; below 0 for a mismatch. None
        where no number decided.
    samples_factor : float or None
        With so many times the samples in both pictures the difference found here would count as real, if it
        stayed as it is; below 1 for what counts already. None where nothing differs.
    """

    verdict: Verdict
    reason: str
    test: Literal["rounding", "blocks", "variances", "diagnosis"]
    margin: float | None
    samples_factor: float | None


def judge(*, equal: bool, bias: Bias, scores: Scores | None, cause: str | None, policy: Policy) -> Judgement:
    """The verdict on two pictures.

    Parameters
    ----------
    equal
        They differ by no more than rounding.
    scores
        Of the noise that both pictures state; it decides in place of `bias` where it is known.
    cause
        The mistake that explains the difference, if there is one.
    """
    if equal:
        return Judgement("match", "No pixel differs by more than rounding.", "rounding", None, None)
    found = _by_blocks(bias, policy) if scores is None else _by_variances(scores)
    if found.verdict == "mismatch" or cause is None:
        return found
    reason = f"Undoing one mistake makes the pictures agree: {cause}."
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


def _by_blocks(bias: Bias, policy: Policy) -> Judgement:
    verdict: Verdict = "mismatch" if bias.share > policy.most_bias else "noisy_match"
    reason = (
        f"{bias.share:.1%} of the blocks are brighter or darker than noise explains, by more than "
        f"{policy.tolerance:g}. Up to {policy.most_bias:.0%} are allowed."
    )
    return Judgement(verdict, reason, "blocks", _margin(bias.share, policy.most_bias), _factor(bias, policy))


def _margin(found: float, limit: float) -> float | None:
    """How far below its limit a number is, as a share of the limit; None where that is no number."""
    return 1 - found / limit if limit > 0 and math.isfinite(found) else None


def _factor(bias: Bias, policy: Policy) -> float | None:
    """Samples over those now with which more than the limit's share of blocks would be biased.

    None where too few blocks differ by more than the tolerance. The ratio of a real
    difference to its noise grows with the root of the samples.
    """
    place = min(int(policy.most_bias * bias.ratios.size), bias.ratios.size - 1)
    last = np.sort(bias.ratios, axis=None)[::-1][place]
    if last == 0:
        return None
    return 0.0 if math.isinf(last) else float(last) ** -2


@dataclass(frozen=True, slots=True)
class Comparison:
    """What comparing two pictures has shown.

    Attributes
    ----------
    image, reference : Picture
    policy : Policy
    metrics : Metrics
    ssim : float or None
        None for pictures smaller than its window.
    flip : float or None
        None if it was not requested.
    bias : Bias
    judgement : Judgement
    causes : tuple of Cause
    regions : tuple of Region
        None where the pictures are equal but for rounding.
    names : sequence of str
        Names of the scene's shapes, by their indices.
    """

    image: Picture
    reference: Picture
    policy: Policy
    metrics: Metrics
    ssim: float | None
    flip: float | None
    bias: Bias
    judgement: Judgement
    causes: tuple[Cause, ...]
    regions: tuple[Region, ...]
    names: Sequence[str]

    @property
    def passed(self) -> bool:
        """Whether the pictures show the same but for noise."""
        return self.judgement.verdict != "mismatch"

    def document(self) -> dict[str, Any]:
        """All of it as JSON values; an infinite PSNR, that of equal pictures, is null."""
        numbers = asdict(self.metrics) | {
            "psnr": _finite(self.metrics.psnr),
            "ssim": self.ssim,
            "bias_blocks": self.bias.share,
            "flip": self.flip,
        }
        return {
            "schema": "penumbra/comparison/v1",
            "verdict": self.judgement.verdict,
            "score": 1.0 if self.passed else 0.0,
            "reason": self.judgement.reason,
            "test": self.judgement.test,
            "margin": self.judgement.margin,
            "samples_factor": self.judgement.samples_factor,
            "metrics": numbers,
            "diagnosis": [asdict(cause) for cause in self.causes],
            "worst_regions": [
                asdict(region) | {"name": named(region.shape, self.names)} for region in self.regions
            ],
            "inputs": {"image": _input(self.image), "reference": _input(self.reference)},
            "policy": asdict(self.policy),
        }


def compare(
    image: Picture,
    reference: Picture,
    *,
    policy: Policy | None = None,
    shapes: NDArray[Any] | None = None,
    names: Sequence[str] = (),
    with_flip: bool = False,
) -> Comparison:
    """Compare a picture with its reference.

    Parameters
    ----------
    policy
        What is taken for the same.
    shapes : (H, W) int, optional
        What each pixel shows, as in the layer ``shape``; by default that layer of the reference, then that of
        the picture.
    names
        Names of the shapes, by index; where they are missing, a shape is named by its index.
    with_flip
        Whether FLIP is computed too. It takes longer than all the rest together.

    Raises
    ------
    NotComparableError
        If the pictures differ in size.
    MissingExtraError
        If FLIP is requested and its package is not installed.
    """
    if image.linear.shape != reference.linear.shape:
        raise NotComparableError(_sizes(image, reference))
    policy = policy or Policy()
    difference = image.linear - reference.linear
    rounding = image.rounding + reference.rounding
    equal = bool((np.abs(difference) <= rounding + GUARD).all())
    allowed = rounding + policy.tolerance
    biased = bias(difference, allowed)
    lumas = luma(image.linear), luma(reference.linear)
    causes = () if equal else diagnose(image.linear, reference.linear, lumas, allowed, policy.most_bias)
    both = variances.known(image) and variances.known(reference)
    scores = variances.scores(image, reference, allowed) if both else None
    judgement = judge(
        equal=equal,
        bias=biased,
        scores=scores,
        cause=causes[0].cause if causes else None,
        policy=policy,
    )
    shapes = _shapes(shapes, reference, image)
    return Comparison(
        image=image,
        reference=reference,
        policy=policy,
        metrics=metrics(image.linear, reference.linear, policy.limit),
        ssim=ssim(*lumas),
        flip=flip(image.linear, reference.linear) if with_flip else None,
        bias=biased,
        judgement=judgement,
        causes=causes,
        regions=() if equal else worst(difference, _suspects(biased, scores), shapes),
        names=_names(names, shapes),
    )


def _sizes(image: Picture, reference: Picture) -> str:
    """Why pictures of different sizes are not compared."""
    swapped = (image.width, image.height) == (reference.height, reference.width)
    return (
        f"{image.name} is {image.width} x {image.height} pixels and {reference.name} is "
        f"{reference.width} x {reference.height}. Pictures are compared pixel by pixel: "
        + ("width and height are swapped." if swapped else "render both at the same size.")
    )


def _suspects(biased: Bias, scores: variances.Scores | None) -> Masks:
    return biased.blocks if scores is None else scores.ratios > 1


def _shapes(given: NDArray[Any] | None, *pictures: Picture) -> NDArray[Any] | None:
    known = [given, *(picture.layers.get("shape") for picture in pictures)]
    return next((shapes for shapes in known if shapes is not None), None)


def _names(names: Sequence[str], shapes: NDArray[Any] | None) -> list[str]:
    count = 0 if shapes is None else int(shapes.max()) + 1
    return [*names, *(f"shape {number}" for number in range(len(names), count))]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _input(picture: Picture) -> dict[str, Any]:
    samples = picture.layers.get("samples")
    return {
        "name": picture.name,
        "sha256": picture.sha256,
        "width": picture.width,
        "height": picture.height,
        "encoding": picture.encoding,
        "encoding_stated": picture.stated,
        "bits": picture.bits,
        "clipped_pixels": picture.clipped,
        "samples": None if samples is None else float(_mean(samples)),
        "notes": list(picture.notes),
    }


def _mean(samples: Floats) -> float:
    return float(samples.mean())
