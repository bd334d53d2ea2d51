"""Find the mistakes of a submission's program in all its pictures together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from accuracy.comparison import Picture, Policy
from renderer.errors import MissingExtraError
from schemas.grading.acceptance import Verdict
from schemas.grading.manifests import ImageTest
from service.grading.errors import GradingError
from service.grading.programs.program import NONE, Pair, ProgramMistake, ProgramMistakes, is_undone
from service.grading.programs.repairing import ambient_term
from service.grading.programs.shared_mistakes import Shared, agree, shared
from service.grading.references import read_picture, reference_picture, reference_scene
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
    seen = {test.id: (test, _pair(test, *pictures)) for test, pictures in _pictures(run)}
    if "ambient" in kinds:
        seen = {test_id: (test, _with_ambient(test, pair, run)) for test_id, (test, pair) in seen.items()}
    program, found = shared([pair for _, pair in seen.values()], kinds)
    everywhere = () if is_undone(program.scale) else ("exposure",)
    return ProgramMistakes(
        program, tuple(_charged(each, list(seen), run, everywhere=each.kind in everywhere) for each in found)
    )


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


def _charged(found: Shared, ids: list[str], run: Run, *, everywhere: bool) -> ProgramMistake:
    """A mistake with the tests in which it costs points: `everywhere` if it cannot be undone."""
    shows = frozenset(test_id for test_id, shown in zip(ids, found.shows, strict=True) if shown)
    listed = next(charge.tests for charge in run.manifest.charged_once if found.kind in charge.mistakes)
    tests = ids if everywhere else listed
    charged = tuple(test_id for test_id in tests if found.cause not in _forgiven(run, test_id))
    return ProgramMistake(found.kind, found.cause, found.hint, shows, charged)


def _forgiven(run: Run, test_id: str) -> tuple[str, ...]:
    """Mistakes that cost nothing in a test that judges their kind."""
    (accept,) = (test.accept for test in run.manifest.tests if test.id == test_id)
    return accept.forgiven if isinstance(accept, Verdict) else ()
