"""The outcome of a test, before it becomes points: also that of a number on a scale."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from accuracy.comparison import Picture
from accuracy.comparison.metrics import ROUNDING_BOUND
from renderer.math.arrays import Floats
from schemas.api.comparisons import ComparisonCause, ComparisonRegion
from schemas.grading.acceptance import Scale
from schemas.grading.grades import GradeInput, GradeVerdict, Signal
from service.grading.folders import Role
from service.grading.likeness.fingerprints import Fingerprint

DIFFERENCE = "difference"
"""Label of the picture that shows no reference."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a test.

    Attributes
    ----------
    share : float
        Share of the points, 0 to 1.
    message : str
        The reason for the share, for students.
    pictures : mapping of str to bytes
        PNG files, by label.
    signals : tuple of Signal
        Signals for staff.
    fingerprint : Fingerprint or None
        Of a submitted picture, to compare it with those of other students.

    The other attributes are those of `schemas.grading.grades.TestGrade`.
    """

    share: float
    message: str
    verdict: GradeVerdict | None = None
    metric: str | None = None
    value: float | None = None
    threshold: float | None = None
    margin: float | None = None
    samples_to_settle: float | None = None
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    diagnosis: tuple[ComparisonCause, ...] = ()
    worst_regions: tuple[ComparisonRegion, ...] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    inputs: tuple[GradeInput, ...] = ()
    signals: tuple[Signal, ...] = ()
    fingerprint: Fingerprint | None = None


def by_number(metric: str, value: float, scale: Scale) -> Outcome:
    """The outcome of a test that a single number decides."""
    side = "more" if scale.rising else "less"
    return Outcome(
        share=share_of(value, scale),
        message=f"{metric} is {value:.4g}; {scale.full:.4g} or {side} earns all points.",
        metric=metric,
        value=value if math.isfinite(value) else None,
        threshold=scale.full,
        margin=margin_of(value, scale),
    )


def share_of(value: float, scale: Scale) -> float:
    """The share of the points that a value earns, 0 to 1.

    A value that misses a threshold only by rounding reaches it.

    >>> from schemas.grading.acceptance import RayShare
    >>> share_of(0.75, RayShare(full=1.0, zero=0.5))
    0.5
    """
    if reached(value, scale.full, rising=scale.rising):
        return 1.0
    for band in scale.bands:
        if reached(value, band.at, rising=scale.rising):
            return band.share
    if scale.zero is None or reached(scale.zero, value, rising=scale.rising):
        return 0.0
    return (scale.zero - value) / (scale.zero - scale.full)


def reached(value: float, threshold: float, *, rising: bool) -> bool:
    """Whether a value is as good as a threshold, up to rounding."""
    beyond = value - threshold if rising else threshold - value
    return beyond >= -ROUNDING_BOUND * max(1.0, abs(threshold)) if math.isfinite(value) else beyond > 0


def margin_of(value: float, scale: Scale) -> float | None:
    """Margin of a value beyond the threshold for full points, relative to the threshold.

    0 if they differ only by rounding; None if the margin is undefined.
    """
    beyond = value - scale.full if scale.rising else scale.full - value
    if scale.full == 0 or not math.isfinite(beyond):
        return None
    return 0.0 if abs(beyond) <= ROUNDING_BOUND * max(1.0, scale.full) else beyond / scale.full


def of_picture(test: str, role: Role, picture: Picture, size: int | None) -> GradeInput:
    """A picture; `size` is None if it was rendered here."""
    samples = picture.layers.get("samples")
    return GradeInput(
        test=test,
        role=role,
        name=picture.name,
        sha256=picture.sha256,
        content=_hashed(_pixels(picture)),
        size=size,
        width=picture.width,
        height=picture.height,
        encoding=picture.encoding,
        samples=None if samples is None else float(samples.mean()),
    )


def of_file(
    test: str, role: Role, name: str, content: bytes, arrays: Mapping[str, Floats] | None = None
) -> GradeInput:
    """Any other file, with the arrays in it if it holds any."""
    return GradeInput(
        test=test,
        role=role,
        name=name,
        sha256=hashlib.sha256(content).hexdigest(),
        content=None if arrays is None else _hashed(_values(arrays)),
        size=len(content),
    )


def _pixels(picture: Picture) -> Iterator[bytes]:
    yield f"{picture.width} x {picture.height}".encode()
    for band in picture.bands():
        yield np.floor(65535 * band.pixels.seen + 0.5).astype("<u2").tobytes()


def _values(arrays: Mapping[str, Floats]) -> Iterator[bytes]:
    for name, values in sorted(arrays.items()):
        # Adding 0 turns -0.0 into 0.0.
        yield f"{name} {values.shape}".encode() + (values + 0.0).tobytes()


def _hashed(parts: Iterable[bytes]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()
