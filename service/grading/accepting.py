"""The points a picture earns: by the verdict, by a metric, or by the error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from accuracy.comparison import Comparison, Picture, Policy, compare, variances
from accuracy.comparison.metrics import metrics
from accuracy.comparison.pixels import AT_ONCE
from schemas.grading.acceptance import Acceptance, Error, Metric, Verdict
from service.grading.errors import BrokenTestError
from service.grading.outcomes import Outcome, by_number, margin_of, share_of
from service.grading.selection import Selection

NOISE = ("error", "samples")
"""Layers that describe the noise of a picture."""

BIAS, NOISY = "bias_blocks", "noisy_blocks"

KNOWN = 16
"""Samples of a pixel from which on a reference knows how noisy a single one is."""


def compared(accept: Acceptance, image: Picture, reference: Picture, blocks: float = 1.0) -> Comparison:
    """Compare two pictures under the policy of a test.

    Parameters
    ----------
    blocks
        Share of the blocks that count; in the others the pictures agree.

    Raises
    ------
    NotComparableError
        They differ in size.
    BrokenTestError
        The test bounds noise, and the reference does not state its own.
    MissingExtraError
        The test uses FLIP, which is not installed.
    """
    if isinstance(accept, Verdict) and (accept.zero is not None or accept.bands):
        # Partial credit depends on the share of biased blocks, so the verdict must too.
        image = noiseless(image)
    flip = isinstance(accept, Metric) and accept.metric == "flip"
    return compare(image, reference, policy=_policy(accept, reference, blocks), with_flip=flip)


def accepted(accept: Acceptance, found: Comparison, selection: Selection) -> Outcome:
    """The outcome for the selected part of two pictures.

    Raises
    ------
    BrokenTestError
        The metric is not defined for these pictures.
    """
    numbers = _numbers(found, selection)
    match accept:
        case Verdict():
            outcome = _by_verdict(accept, found, numbers[BIAS] or 0.0)
        case Metric():
            outcome = by_number(accept.metric, _value(accept, numbers), accept)
        case Error():
            noise = numbers.get("reference_noise") or 0.0
            error = math.sqrt(max((numbers["mse"] or 0.0) - noise * noise, 0.0))
            outcome = by_number("error", error, accept)
    return replace(outcome, metrics=numbers)


def _policy(accept: Acceptance, reference: Picture, blocks: float) -> Policy:
    match accept:
        case Verdict():
            return Policy(
                tolerance=accept.tolerance,
                most_bias=accept.full * blocks,
                limit=accept.limit,
                samples=_fewest_samples(accept, reference),
            )
        case Metric():
            return Policy(tolerance=accept.tolerance, limit=accept.limit)
        case _:
            return Policy()


def _fewest_samples(accept: Verdict, reference: Picture) -> int | None:
    """The fewest random samples whose noise is allowed; None for any noise."""
    known = variances.known(reference)
    if accept.samples is None:
        return 1 if known and reference.layers["samples"].min() >= KNOWN else None
    if accept.samples == "any":
        return None
    if known:
        return accept.samples
    raise BrokenTestError(
        f"It allows the noise of {accept.samples} samples, and {reference.name} does not state its own. Give "
        "the reference the layers error and samples: render it with random patterns, or state 'samples: any'."
    )


def noiseless(picture: Picture) -> Picture:
    """The picture without its noise layers, so that the verdict compares blocks."""
    kept = {name: layer for name, layer in picture.layers.items() if name not in NOISE}
    return replace(picture, layers=kept)


def _numbers(found: Comparison, selection: Selection) -> Mapping[str, float | None]:
    """All metrics of the selected pixels; `ssim` and `flip` cover the rectangle around them."""
    numbers: dict[str, float | None] = found.document()["metrics"]
    if selection.pixels is not None:
        pictures = [selection.counted(picture.linear) for picture in (found.image, found.reference)]
        own = metrics(pictures[0], pictures[1], found.policy.limit)
        numbers |= {name: getattr(own, name) for name in ("mse", "rmse", "relmse", "max_abs", "frac_over")}
        numbers["psnr"] = own.psnr if math.isfinite(own.psnr) else None
        numbers[BIAS] = found.bias.share / selection.blocks
    noise = found.reference.layers.get("error")
    if noise is not None and np.isfinite(noise).all():
        counted = selection.counted(noise).ravel()
        parts = np.array_split(counted, counted.size // AT_ONCE + 1)
        squares = math.fsum(float(np.square(part, dtype=np.float64).sum()) for part in parts)
        numbers["reference_noise"] = math.sqrt(squares / counted.size)
    return numbers


def _value(accept: Metric, numbers: Mapping[str, float | None]) -> float:
    value = numbers[accept.metric]
    if value is not None:
        return value
    if accept.metric == "psnr":
        return math.inf
    raise BrokenTestError("These pictures are too small for ssim, whose window has 11 x 11 pixels.")


def _by_verdict(accept: Verdict, found: Comparison, share: float) -> Outcome:
    judgement = found.judgement
    by_blocks = judgement.test == "blocks"
    noisy = found.noise.share if judgement.test == "noise" and found.noise is not None else None
    earned = 1.0 if found.passed else _partial(accept, found, share)
    return Outcome(
        share=earned,
        message=_blocks(accept, share) if by_blocks else judgement.reason,
        metric=BIAS if noisy is None else NOISY,
        value=share if noisy is None else noisy,
        threshold=accept.full,
        margin=margin_of(share, accept) if by_blocks else judgement.margin,
    )


def _partial(accept: Verdict, found: Comparison, share: float) -> float:
    """The share a mismatch earns: always below 1, even when few blocks are biased."""
    # A block that is wrong beyond doubt costs something even where no other is.
    certain = found.judgement.test == "block"
    by_share = share_of(share + accept.full if certain else share, accept)
    explained = any(cause.is_undone for cause in found.causes)
    # What explains noise does not show that all else is right.
    by_cause = accept.diagnosed if explained and found.judgement.test != "noise" else 0.0
    return max(by_share if by_share < 1.0 else 0.0, by_cause)


def _blocks(accept: Verdict, share: float) -> str:
    return (
        f"{100 * share:.1f} % of the blocks of 8 x 8 pixels are brighter or darker than noise explains, by "
        f"more than {accept.tolerance:g}; up to {100 * accept.full:.1f} % are allowed."
    )
