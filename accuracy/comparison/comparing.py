"""Comparing a picture with its reference: metrics, verdict, causes, and regions that differ."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison import variances
from accuracy.comparison.blocks import Bias, bias
from accuracy.comparison.decoding import refuse_other_size
from accuracy.comparison.diagnosis import (
    STORED,
    STORED_REASON,
    Cause,
    diagnose,
    predicted,
    stored_or_filtered,
)
from accuracy.comparison.inputs import Picture
from accuracy.comparison.judging import Judgement, Policy, judge
from accuracy.comparison.metrics import ROUNDING_BOUND, Metrics, Similarity, Sums, flip, luma_of_seen
from accuracy.comparison.noise import Noise, allowed_variances, excesses, judged
from accuracy.comparison.regions import Region, named, squares_of, worst
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
        None unless both the policy and the reference bound it.
    judgement : Judgement
    causes : tuple of Cause
    regions : tuple of Region
        None if the pictures are equal but for rounding.
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
        """Whether the pictures agree up to noise."""
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
        Differences that are tolerated.
    shapes : (H, W) int, optional
        The shape that each pixel shows, as in the layer ``shape``; by default that layer of the reference,
        then that of the picture.
    names
        Names of the shapes, by index; where they are missing, a shape is named by its index.
    with_flip
        Whether FLIP is computed too. It takes longer than everything else.

    Raises
    ------
    NotComparableError
        If the pictures differ in size.
    MissingExtraError
        If FLIP is requested and its package is not installed.
    """
    refuse_other_size(image.name, image.size, reference.size)
    policy = policy or Policy()
    found = _found(image, reference, policy)
    judgement, causes = _judged(image, reference, policy, found)
    shapes = _shapes(shapes, reference, image)
    regions: tuple[Region, ...] = ()
    if not found.equal:
        suspects = _suspects(judgement, found.bias, found.noise, found.scores)
        regions = worst(_Difference(image, reference), found.squares, suspects, shapes)
    return Comparison(
        image=image,
        reference=reference,
        policy=policy,
        metrics=found.metrics,
        ssim=found.ssim,
        flip=flip(image.linear, reference.linear) if with_flip else None,
        bias=found.bias,
        noise=found.noise,
        judgement=judgement,
        causes=causes,
        regions=regions,
        names=_names(names, shapes),
    )


@dataclass(frozen=True, slots=True)
class _Found:
    """Statistics of all bands; `squares` are sums in blocks, (rows, columns)."""

    equal: bool
    metrics: Metrics
    ssim: float | None
    bias: Bias
    noise: Noise | None
    scores: Scores | None
    squares: Floats


@dataclass(frozen=True, slots=True)
class _Band:
    """Statistics of a band, its blocks in `squares`, `noise` and `scores` as in those of the picture."""

    equal: bool
    sums: Sums
    bias: Bias
    squares: Floats
    noise: tuple[Floats, Masks] | None
    scores: Floats | None


def _found(image: Picture, reference: Picture, policy: Policy) -> _Found:
    scored = variances.known(image) and variances.known(reference)
    samples = policy.samples if variances.known(reference) else None
    similarity, parts = Similarity(), list[_Band]()
    for one, other in zip(image.bands(), reference.bands(), strict=True):
        similarity.add(luma_of_seen(one.pixels.seen), luma_of_seen(other.pixels.seen))
        parts.append(_band(one, other, policy, samples, scored=scored))
    noises, scores = (
        [each for part in parts if (each := getattr(part, name)) is not None] for name in ("noise", "scores")
    )
    noise = None
    if noises and samples is not None:
        ratios, spots = (np.concatenate(each) for each in zip(*noises, strict=True))
        noise = judged(ratios, spots, samples)
    return _Found(
        equal=all(part.equal for part in parts),
        metrics=Sums.joined([part.sums for part in parts]).metrics(),
        ssim=similarity.mean,
        bias=Bias.joined([part.bias for part in parts]),
        noise=noise,
        scores=variances.scores(np.concatenate(scores)) if scores else None,
        squares=np.concatenate([part.squares for part in parts]),
    )


def _band(image: Picture, reference: Picture, policy: Policy, samples: int | None, *, scored: bool) -> _Band:
    difference, rounding = image.linear - reference.linear, image.rounding + reference.rounding
    allowed = rounding + policy.tolerance
    most = None if samples is None else allowed_variances(reference, samples, rounding, policy.tolerance)
    return _Band(
        equal=bool((np.abs(difference) <= rounding + ROUNDING_BOUND).all()),
        sums=Sums.of(difference, reference.linear, policy.limit),
        bias=bias(difference, allowed, most),
        squares=squares_of(difference),
        noise=None if most is None else excesses(difference, most),
        scores=variances.block_scores(image, reference, allowed) if scored else None,
    )


def _judged(
    image: Picture, reference: Picture, policy: Policy, found: _Found
) -> tuple[Judgement, tuple[Cause, ...]]:
    """The verdict, and the mistakes that explain it."""
    causes = () if found.equal else diagnose(image, reference, policy.tolerance, policy.most_bias)
    judgement = judge(
        equal=found.equal,
        bias=found.bias,
        scores=found.scores,
        explained=bool(causes),
        policy=policy,
        noise=found.noise,
    )
    if judgement.verdict == "mismatch" and not causes and variances.known(reference):
        if judgement.test == "noise":
            causes = stored_or_filtered(image, reference)
            if any(cause.cause in STORED for cause in causes):
                judgement = replace(judgement, reason=STORED_REASON)
        else:
            causes = predicted(image, reference, policy.tolerance, policy.most_bias)
    return judgement, causes


class _Difference:
    """The difference of two pictures, whose rows are computed on demand."""

    def __init__(self, image: Picture, reference: Picture) -> None:
        self._image, self._reference = image.pixels, reference.pixels
        self.shape = image.pixels.shape

    def __getitem__(self, rows: slice) -> Floats:
        return np.asarray(self._image.part(rows).linear - self._reference.part(rows).linear)


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
