"""Explain wrong hits: a mistake behind many of them, the shape most should hit, and an example row."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.regions import named
from accuracy.comparison.shown import names_of
from renderer.math.arrays import Floats, Masks
from schemas.scene import Scene
from service.grading.mistakes.altered_shading import bent, of_sphere
from service.grading.mistakes.hints import HINTS
from service.grading.rays.ray_agreement import Answers, near
from service.grading.rays.ray_sources import RayList

MANY = 0.5
"""A mistake is reported if it explains more than this share of the wrong rays."""

DIGITS = 1e-3
"""A smaller relative error suggests single precision: a quadratic loses half of its seven digits when a
sphere is far away."""


def reasons_of(
    submitted: Mapping[str, Floats],
    right: Answers,
    agrees: Mapping[str, Masks],
    cast: RayList,
    document: Scene,
) -> list[str]:
    """Sentences for students about the differences; empty if there are none."""
    names = names_of(document)
    wrong = {name: ~right.doubtful & ~those for name, those in agrees.items()}
    counts = {name: np.count_nonzero(rows) for name, rows in wrong.items() if rows.any()}
    if not counts:
        return []
    first = next(iter(counts))
    rows = wrong[first]
    row = int(np.flatnonzero(rows)[0])
    found, wanted = (_written(values[row]) for values in (submitted[first], getattr(right.hits, first)))
    listed = ", ".join(f"{name} in {count}" for name, count in counts.items())
    return [
        f"They differ in: {listed}.",
        *(
            advice
            for (field, explained), advice in _mistakes(submitted, right, cast, document)
            if _explains(explained, wrong[field])
        ),
        _where(right.hits.shape[rows], names),
        f"In row {row}, {first} is {found} and should be {wanted}.",
    ]


def _mistakes(
    submitted: Mapping[str, Floats], right: Answers, cast: RayList, document: Scene
) -> Iterator[tuple[tuple[str, Masks], str]]:
    """The field that a mistake affects, the rays that it explains, and how to fix it."""
    with np.errstate(invalid="ignore"):
        if "normal" in submitted:
            yield from _of_normals(submitted["normal"], right, document)
        unhit = _unhit(submitted, right)
        if unhit.any():
            names = names_of(document)
            never = ", ".join(names[shape] for shape in np.unique(right.hits.shape[unhit]))
            field = "t" if "t" in submitted else "shape"
            yield (field, unhit), f"No ray hits {never}: check how it is read, and its intersection."
        if "t" in submitted:
            yield from _of_distances(submitted["t"], right, cast, unhit)


def _of_normals(normals: Floats, right: Answers, document: Scene) -> Iterator[tuple[tuple[str, Masks], str]]:
    wanted, allowed = right.hits.normal, right.allowed["normal"]
    turned = near(normals, -wanted, allowed)
    yield ("normal", turned), "Normals point the wrong way: turn them towards the ray's origin."
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, lengths, where=lengths > 0, out=np.zeros_like(wanted))
    long = near(unit, wanted, allowed)
    yield ("normal", long), "Normals do not have length 1: normalise them."
    spheres = bent(of_sphere, document, right.hits.shape, right.hits.position, wanted)
    yield ("normal", near(unit, spheres, allowed) & ~long), HINTS["normals_of_spheres"]


def _unhit(submitted: Mapping[str, Floats], right: Answers) -> Masks:
    """Rays that should hit a shape that no ray of the submission hits."""
    if "shape" not in submitted:
        return np.zeros(right.doubtful.shape, dtype=bool)
    there: Masks = np.isin(right.hits.shape, submitted["shape"].astype(np.int64))
    return ~there & (right.hits.shape >= 0)


def _of_distances(
    t: Floats, right: Answers, cast: RayList, unhit: Masks
) -> Iterator[tuple[tuple[str, Masks], str]]:
    wanted, allowed = right.hits.t, right.allowed["t"]
    lengths = np.linalg.norm(cast.directions, axis=1)
    scaled = near(t, wanted * lengths, allowed * lengths)
    yield ("t", scaled), "t is a distance; it must be in units of the length of the given direction."
    yield ("t", t < 0), "Many hits lie behind the origin: only t > 0 counts."
    close = np.isfinite(wanted) & (np.abs(t - wanted) <= DIGITS * np.abs(wanted))
    yield ("t", close & ~scaled), "Hits are accurate to a few digits only: calculate in float64."
    both = np.isfinite(wanted) & np.isfinite(t)
    behind = both & (t > wanted) & ~(unhit | close | scaled)
    yield ("t", behind), "Many hits lie behind the right ones: take the nearest in front of the origin."
    extra = np.isinf(wanted) & np.isfinite(t) & (t > 0)
    yield ("t", extra), "Many rays hit what they should miss: check the edges of flat shapes."
    lost = np.isfinite(wanted) & np.isinf(t) & ~unhit
    limit = next(filter(None, (_limit(lost, both, far) for far in (wanted, wanted * lengths))), "")
    yield ("t", lost), "Many rays miss what they should hit." + limit


def _limit(lost: Masks, found: Masks, far: Floats) -> str:
    """A sentence if every missing hit is farther away than every one found."""
    if not (lost.any() and found.any()) or far[lost].min() <= far[found].max():
        return ""
    return f" All of these hits lie beyond {far[found].max():.4g}: a ray does not end."


def _explains(explained: Masks, wrong: Masks) -> bool:
    return bool(np.count_nonzero(wrong & explained) > MANY * np.count_nonzero(wrong))


def _where(shapes: NDArray[np.int64], names: Sequence[str]) -> str:
    hit, counts = np.unique(shapes, return_counts=True)
    most = int(counts.argmax())
    return f"Of these rays {counts[most]} should hit {named(int(hit[most]), names)}."


def _written(value: Floats) -> str:
    return np.array2string(np.asarray(value), precision=6, separator=", ")
