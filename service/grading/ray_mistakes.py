"""Why hits differ: a mistake that explains many rays, the shape that most should meet, a row to look at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.arrays import Floats, Masks
from renderer.comparison.regions import named
from service.grading.ray_agreement import Answers
from service.grading.ray_sources import RayList

MANY = 0.5
"""Share of the rays that hit something and differ; what explains more of them is told."""


def reasons_of(
    submitted: Mapping[str, Floats],
    right: Answers,
    agrees: Mapping[str, Masks],
    cast: RayList,
    names: Sequence[str],
) -> list[str]:
    """Sentences on what differs, for students; empty where nothing does."""
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
        *(advice for explains, advice in _mistakes(submitted, right, cast) if _explains(explains, wrong)),
        _where(right.hits.shape[rows], names),
        f"In row {row}, {first} is {found} and should be {wanted}.",
    ]


def _mistakes(
    submitted: Mapping[str, Floats], right: Answers, cast: RayList
) -> Iterator[tuple[tuple[str, Masks], str]]:
    """The field that a mistake spoils, the rays that it explains, and what to do."""
    hits, allowed = right.hits, right.allowed
    with np.errstate(invalid="ignore"):
        if "normal" in submitted:
            turned = _near(submitted["normal"], -hits.normal, allowed["normal"])
            yield ("normal", turned), "Normals point the wrong way: turn them towards the ray's origin."
            lengths = np.linalg.norm(submitted["normal"], axis=1, keepdims=True)
            unit = np.divide(submitted["normal"], lengths, where=lengths > 0, out=np.zeros_like(hits.normal))
            long = _near(unit, hits.normal, allowed["normal"])
            yield ("normal", long), "Normals do not have length 1: normalise them."
        if "t" in submitted:
            lengths = np.linalg.norm(cast.directions, axis=1)
            scaled = _near(submitted["t"], hits.t * lengths, allowed["t"] * lengths)
            yield ("t", scaled), "t is a distance; it must count in lengths of the direction that is given."
            behind = np.isfinite(hits.t) & np.isfinite(submitted["t"]) & (submitted["t"] > hits.t)
            yield (
                ("t", behind),
                "Many hits lie behind the right ones: take the nearest in front of the origin.",
            )
            lost = np.isfinite(hits.t) & np.isinf(submitted["t"])
            yield ("t", lost), "Many rays miss what they should hit."


def _near(values: Floats, wanted: Floats, allowed: Floats) -> Masks:
    close = (np.abs(values - wanted) <= allowed).reshape(len(values), -1)
    whole: Masks = np.logical_and.reduce(close, axis=1)
    return whole


def _explains(mistake: tuple[str, Masks], wrong: Mapping[str, Masks]) -> bool:
    field, explained = mistake
    rows = wrong[field]
    return bool(np.count_nonzero(rows & explained) > MANY * np.count_nonzero(rows))


def _where(shapes: NDArray[np.int64], names: Sequence[str]) -> str:
    met, counts = np.unique(shapes, return_counts=True)
    most = int(counts.argmax())
    return f"Of these rays {counts[most]} should meet {named(int(met[most]), names)}."


def _written(value: Floats) -> str:
    return np.array2string(np.asarray(value), precision=6, separator=", ")
