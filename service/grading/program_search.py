"""Find the mistakes of a submission's program in all its pictures together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from accuracy.comparison import Picture, Policy
from renderer.errors import MissingExtraError
from schemas.grading.acceptance import Verdict
from schemas.grading.manifests import ImageTest
from service.grading.errors import GradingError
from service.grading.programs.program import (
    NONE,
    Pair,
    Program,
    ProgramMistake,
    ProgramMistakes,
    is_undone,
)
from service.grading.programs.shared_mistakes import agree, shared
from service.grading.references import read_picture, reference_picture, reference_scene
from service.grading.repairing import ambient_term
from service.grading.settings import Run

LEAST_SIDE = 3
"""Pixels along the shorter side of a picture in which a shift can be seen."""


def search(run: Run) -> ProgramMistakes:
    """The mistakes of a program that the manifest charges once.

    Pictures that are missing or cannot be compared are left out.
    """
    kinds = {kind for charge in run.manifest.charged_once for kind in charge.mistakes}
    # Pictures that agree need not be in memory together.
    if all(agree(*pictures, _tolerance(test)) for test, pictures in _pictures(run)):
        return NONE
    seen = {test.id: _pair(test, *pictures) for test, pictures in _pictures(run)}
    if "ambient" in kinds:
        tests = {test.id: test for test in run.manifest.tests if isinstance(test, ImageTest)}
        seen = {name: _with_ambient(tests[name], pair, run) for name, pair in seen.items()}
    made = shared(seen, kinds)
    return replace(made, found=tuple(_charged(each, made.program, [*seen], run) for each in made.found))


def _pictures(run: Run) -> Iterator[tuple[ImageTest, tuple[Picture, Picture]]]:
    """Tests with their pictures and references, those left out that cannot be compared."""
    for test in run.manifest.tests:
        if isinstance(test, ImageTest):
            asked = test.submitted
            try:
                reference = reference_picture(test.reference, run)
                _, picture = read_picture(run.submission, asked.file, asked.encoding, reference.size)
            except (GradingError, MissingExtraError):
                # The test itself reports it.
                continue
            if min(reference.size) >= LEAST_SIDE:
                yield test, (picture, reference)


def _pair(test: ImageTest, picture: Picture, reference: Picture) -> Pair:
    allowed = picture.rounding + reference.rounding + _tolerance(test)
    return Pair(picture.linear, reference.linear, allowed)


def _tolerance(test: ImageTest) -> float:
    return test.accept.tolerance if isinstance(test.accept, Verdict) else Policy().tolerance


def _with_ambient(test: ImageTest, pair: Pair, run: Run) -> Pair:
    try:
        scene = reference_scene(test.reference, run)
    except GradingError:
        return pair
    return pair if scene is None else replace(pair, ambient=ambient_term(scene, samples=1))


def _charged(found: ProgramMistake, program: Program, pictures: Sequence[str], run: Run) -> ProgramMistake:
    """A mistake with the tests in which it costs points: all of pictures if it cannot be undone."""
    tests = next(charge.tests for charge in run.manifest.charged_once if found.kind in charge.mistakes)
    if found.kind == "exposure" and not is_undone(program.scale):
        tests = tuple(pictures)
    return replace(found, charged=tuple(each for each in tests if found.cause not in _forgiven(run, each)))


def _forgiven(run: Run, test_id: str) -> tuple[str, ...]:
    """Mistakes that cost nothing in a test that judges their kind."""
    (accept,) = (test.accept for test in run.manifest.tests if test.id == test_id)
    return accept.forgiven if isinstance(accept, Verdict) else ()
