"""The outcome of a test, before it becomes points."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from accuracy.comparison import Picture
from renderer.math.arrays import Floats
from schemas.api.comparisons import ComparisonCause, ComparisonRegion
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
