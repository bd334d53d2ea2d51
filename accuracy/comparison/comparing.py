"""Comparing a picture with its reference: metrics, verdict, causes, and regions that differ."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison import variances
from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.decoding import refuse_other_size
from accuracy.comparison.diagnosis import Cause, diagnose, filtered
from accuracy.comparison.inputs import Picture
from accuracy.comparison.judging import Judgement, Policy, judge
from accuracy.comparison.metrics import GUARD, Metrics, flip, luma, metrics, ssim
from accuracy.comparison.noise import Noise, allowed_variances, noise
from accuracy.comparison.regions import Region, named, worst
from accuracy.comparison.variances import Scores
from renderer.math.arrays import Floats, Masks


@dataclass(frozen=True, slots=True)
class Comparison:
    """Result of comparing two pictures.

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
    noise : Noise or None
        None where the policy or the reference does not say how much is allowed.
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
    noise: Noise | None
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
    refuse_other_size(image.name, image.size, reference.size)
    policy = policy or Policy()
    difference = image.linear - reference.linear
    rounding = image.rounding + reference.rounding
    equal = bool((np.abs(difference) <= rounding + GUARD).all())
    allowed = rounding + policy.tolerance
    most = _most(reference, policy, rounding)
    biased = bias(difference, allowed, most)
    noisy = None if most is None or policy.samples is None else noise(difference, most, policy.samples)
    lumas = luma(image.linear), luma(reference.linear)
    errors = reference.layers["error"].astype(np.float64) if variances.known(reference) else None
    causes: tuple[Cause, ...] = ()
    if not equal:
        causes = diagnose(image.linear, reference.linear, lumas, allowed, policy.most_bias, errors)
    both = variances.known(image) and variances.known(reference)
    scores = variances.scores(image, reference, allowed) if both else None
    judgement = judge(
        equal=equal,
        bias=biased,
        scores=scores,
        explained=bool(causes),
        policy=policy,
        noise=noisy,
    )
    if judgement.test == "noise" and not causes and errors is not None:
        causes = filtered(image.linear, reference.linear, errors)
    shapes = _shapes(shapes, reference, image)
    return Comparison(
        image=image,
        reference=reference,
        policy=policy,
        metrics=metrics(image.linear, reference.linear, policy.limit),
        ssim=ssim(*lumas),
        flip=flip(image.linear, reference.linear) if with_flip else None,
        bias=biased,
        noise=noisy,
        judgement=judgement,
        causes=causes,
        regions=() if equal else worst(difference, _suspects(judgement, biased, noisy, scores), shapes),
        names=_names(names, shapes),
    )


def _most(reference: Picture, policy: Policy, rounding: Floats) -> Floats | None:
    """The variance that noise may have in each pixel; None for any."""
    if policy.samples is None:
        return None
    return allowed_variances(reference, policy.samples, rounding, policy.tolerance)


def _suspects(judgement: Judgement, biased: Bias, noisy: Noise | None, scores: Scores | None) -> Masks:
    if scores is not None:
        return scores.ratios > 1
    return noisy.blocks if noisy is not None and judgement.test == "noise" else biased.blocks


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
