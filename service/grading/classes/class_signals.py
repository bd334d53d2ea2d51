"""Signals about the submissions of a class: files and noise that several of them have in common."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import renderer
from accuracy.comparison.blurs import smoothed
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from schemas.grading.classes import NotCompared, SharedFiles, SharedNoise
from schemas.grading.grades import Grade
from schemas.grading.manifests import ImageTest, Manifest, ReferencePicture
from schemas.quality import Antialiasing, LightSampling
from service.grading.folders import Folder
from service.grading.grading import reference_folder
from service.grading.likeness.fingerprints import (
    FEWEST_PICTURES,
    Fingerprint,
    Noise,
    Pair,
    fingerprint,
    like,
    noise_of,
    pairs,
    parts,
)
from service.grading.mistakes.reproductions import quality_of
from service.grading.references import Wanted, key_of, prepare, wanted
from service.grading.settings import Run

FIXED = (("center", 1), ("uniform", 4), ("uniform", 9), ("uniform", 16), ("rotated", 4), ("rotated", 16))
"""Patterns and numbers of samples that any two programs may choose, which gives them the same errors."""

Prints = Mapping[str, Mapping[str, Fingerprint]]
"""Fingerprints by student and test."""

FILTERS = 0.4, 0.8
"""Deviations of Gaussians, in pixels: at edges all filters wider than a pixel err like one of them."""

EXPLAINED = "They agree as programs with the same filter or the same fixed samples do."
NOISELESS = "Hardly any place in them is noisy."


def shared_files(grades: Mapping[str, Grade]) -> tuple[SharedFiles, ...]:
    """Groups of students who submitted the same for a test; one entry for each group.

    Rendered pictures do not count: right scenes have the same one.
    """
    owners = defaultdict[tuple[str, str], set[str]](set)
    for student, grade in grades.items():
        for read in grade.inputs:
            same = read.content or read.sha256
            if read.role == "submission" and read.size is not None and same is not None:
                owners[read.test, same].add(student)
    groups = defaultdict[tuple[str, ...], list[str]](list)
    for (test, _), students in owners.items():
        if len(students) > 1:
            groups[tuple(sorted(students))].append(test)
    found = [SharedFiles(students=students, tests=tuple(sorted(tests))) for students, tests in groups.items()]
    return tuple(sorted(found, key=_most_first))


def shared_noise(
    manifest: Manifest,
    references: Path,
    prints: Prints,
    files: Sequence[SharedFiles],
) -> tuple[tuple[SharedNoise, ...], tuple[NotCompared, ...]]:
    """Groups of students whose pictures have the same noise, and the pictures that were not compared.

    Parameters
    ----------
    references
        The folder of the manifest.
    prints
        Of all students.
    files
        Shared files, which are not reported again.
    """
    folder = Folder(references.resolve(), "reference")
    run = Run(manifest, folder, folder)
    groups = defaultdict[tuple[str, ...], dict[str, float]](dict)
    left_out: list[NotCompared] = []
    for test in manifest.tests:
        if not isinstance(test, ImageTest):
            continue
        owners = [student for student, found in prints.items() if test.id in found]
        noise = noise_of([prints[owner][test.id] for owner in owners])
        left_out += _left_out(test.id, prints, noise)
        found, explained = ([], set()) if noise is None else _found(test, run, noise)
        if explained:
            students = tuple(owners[member] for member in sorted(explained))
            left_out.append(NotCompared(test=test.id, reason=EXPLAINED, students=students))
        for members, correlation in joined(found):
            students = tuple(sorted(owners[member] for member in members))
            if not any(test.id in same.tests and {*students} <= {*same.students} for same in files):
                groups[students][test.id] = correlation
    shared = [
        SharedNoise(students=students, tests=tuple(sorted(tests)), correlation=round(min(tests.values()), 3))
        for students, tests in groups.items()
    ]
    return tuple(sorted(shared, key=_most_first)), tuple(left_out)


def _left_out(test: str, prints: Prints, noise: Noise | None) -> Iterator[NotCompared]:
    """The pictures of a test whose noise is compared with no others."""
    owners = [student for student, found in prints.items() if test in found]
    unlike = () if noise is None else np.flatnonzero(~noise.counted.any(axis=1)).tolist()
    too_few = f"Only {len(owners)} are without a mistake, and comparing noise needs {FEWEST_PICTURES}."
    reasons = {
        "They were not submitted, or have a mistake.": [each for each in prints if test not in prints[each]],
        "They are far noisier or cleaner than most, or wrong in many places.": [owners[i] for i in unlike],
        too_few if len(owners) < FEWEST_PICTURES else NOISELESS: owners if noise is None else [],
    }
    for reason, students in reasons.items():
        if students:
            yield NotCompared(test=test, reason=reason, students=tuple(students))


def _most_first(shared: SharedFiles | SharedNoise) -> tuple[int, tuple[str, ...]]:
    return -len(shared.tests), shared.students


def _found(test: ImageTest, run: Run, noise: Noise) -> tuple[list[Pair], set[int]]:
    """Pairs of pictures of a test that share their noise, and the pictures that have other reasons to."""
    reported: list[Pair] = []
    explained: set[int] = set()
    innocent: list[Fingerprint] = []
    for part in parts(noise):
        found = pairs(part)
        if found:
            # Rendering takes seconds, and hardly any class needs it.
            innocent = innocent or _innocent(test, run)
            (alike,) = np.nonzero(like(part, innocent))
            explained |= {*alike.tolist()} & {each for pair in found for each in (pair.first, pair.second)}
            reported += found
    return [pair for pair in reported if explained.isdisjoint((pair.first, pair.second))], explained


def joined(found: Iterable[Pair]) -> list[tuple[set[int], float]]:
    """Pairs that have a picture in common as groups, each with its lowest correlation.

    >>> joined([Pair(0, 1, 0.9), Pair(2, 3, 0.8), Pair(1, 4, 0.7)])
    [({2, 3}, 0.8), ({0, 1, 4}, 0.7)]
    """
    groups: list[tuple[set[int], float]] = []
    for pair in found:
        members, lowest = {pair.first, pair.second}, pair.correlation
        for group, correlation in [each for each in groups if each[0] & members]:
            groups.remove((group, correlation))
            members, lowest = members | group, min(lowest, correlation)
        groups.append((members, lowest))
    return groups


def _innocent(test: ImageTest, run: Run) -> list[Fingerprint]:
    """The errors of wider filters, and of fixed patterns if the manifest names the scene of a test."""
    reference = _reference(test, run)
    shown = [smoothed(reference.picture.linear, width) for width in FILTERS]
    if reference.scene is not None:
        shown += [_by_pattern(reference.scene, *each) for each in FIXED]
    picture = reference.picture
    return [fingerprint(picture.with_values(each, picture.rounding), picture) for each in shown]


def _by_pattern(scene: LoadedScene, pattern: str, samples: int) -> Floats:
    pixels = Antialiasing.model_validate({"pattern": pattern, "samples": samples})
    quality = quality_of(scene, pixels, LightSampling(pattern="uniform", samples=samples))
    image = renderer.render(renderer.compile_scene(scene, quality)).image
    return np.clip(image, 0, 1).astype(np.float64)


def _reference(test: ImageTest, run: Run) -> Wanted:
    """The reference of a test, rendered if it is a scene."""
    asked = test.reference
    if isinstance(asked, ReferencePicture):
        return wanted(asked, run)
    with reference_folder(None) as folder:
        prepared = prepare(run.order(run.references, asked.file, asked.quality, run.deadline(test)), folder)
        return wanted(asked, replace(run, prepared={key_of(asked): prepared}))
