"""Assemble the native result from the outcomes of tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

from schemas.grading.grades import (
    Grade,
    GradeImage,
    GradeTimings,
    GradeTool,
    GradeVerdict,
    Status,
    TestGrade,
)
from schemas.grading.manifests import Criterion, Manifest
from service.grading import sentences
from service.grading.adjustments import Correction, corrected, lateness, status_of
from service.grading.errors import BrokenTestError, GradingError, NotGradableError, NotSubmittedError
from service.grading.outcomes import DIFFERENCE, Outcome
from service.grading.processes import Finished

_STATUS: dict[type, Status] = {
    NotSubmittedError: "skipped",
    NotGradableError: "not_gradable",
    BrokenTestError: "error",
}


@dataclass(frozen=True, slots=True)
class Tested:
    """The result of a test; the pictures of its outcome have the names in the grade."""

    grade: TestGrade
    outcome: Outcome


def tested(test: Criterion, finished: Finished) -> Tested:
    """The grade of a test, also if it failed to run."""
    if isinstance(finished.result, Outcome):
        outcome, status = finished.result, status_of(finished.result.share)
    else:
        outcome = Outcome(share=0.0, message=trouble(finished))
        status = _STATUS.get(type(finished.error), "error")
    names = {label: f"{test.id}-{number}.png" for number, label in enumerate(outcome.pictures, 1)}
    whole = TestGrade(
        id=test.id,
        name=test.name,
        kind=test.kind,  # type: ignore[attr-defined]  # every kind of criterion has it
        points=test.points * outcome.share,
        max_points=test.points,
        bonus=test.bonus,
        status=status,
        hidden=test.hidden,
        tags=test.tags,
        message=sentences.joined(outcome.message, None if status == "passed" else test.advice),
        verdict="not_comparable" if status == "not_gradable" else outcome.verdict,
        metric=outcome.metric,
        value=outcome.value,
        threshold=outcome.threshold,
        margin=outcome.margin,
        samples_to_settle=outcome.samples_to_settle,
        metrics={name: _finite(value) for name, value in outcome.metrics.items()},
        diagnosis=outcome.diagnosis,
        worst_regions=outcome.worst_regions,
        images=tuple(
            GradeImage(label=label, file=name, feedback="difference" if label == DIFFERENCE else "picture")
            for label, name in names.items()
        ),
        cpu_seconds=finished.cpu_seconds,
        seconds=finished.seconds,
    )
    pictures = {names[label]: png for label, png in outcome.pictures.items()}
    return Tested(whole, replace(outcome, pictures=pictures))


def graded(
    manifest: Manifest,
    tests: Sequence[Tested],
    timings: GradeTimings,
    *,
    student: str | None = None,
    submitted: str | None = None,
    corrections: Sequence[Correction] = (),
) -> Grade:
    """The whole result."""
    grades = [
        each.model_copy(update={"feedback": test.feedback or manifest.feedback})
        for test, each in zip(manifest.tests, _with_requirements(manifest, tests, corrections), strict=True)
    ]
    verdict = _verdict(grades)
    # fsum rounds once, so shares of points add up exactly.
    earned = math.fsum(grade.points for grade in grades)
    full = math.fsum(grade.max_points for grade in grades if not grade.bonus)
    # Where all tests are a bonus they are the whole.
    whole = full or math.fsum(grade.max_points for grade in grades)
    late = lateness(manifest.late, submitted, whole, earned)
    return Grade(
        title=manifest.title,
        student=student,
        submitted=submitted,
        own_scenes=manifest.per_student is not None,
        gradable=verdict != "not_comparable",
        ungraded=tuple(grade.id for grade in grades if grade.is_open),
        verdict=verdict,
        score=earned - late.points if late else earned,
        max_score=full,
        late=late,
        tests=tuple(grades),
        signals=tuple(signal for test in tests for signal in test.outcome.signals),
        inputs=tuple(read for test in tests for read in test.outcome.inputs),
        policy={test.id: test.accept.model_dump(mode="json") for test in manifest.tests},
        tool=GradeTool(version=version("penumbra-render")),
        timings=timings,
    )


def _with_requirements(
    manifest: Manifest, tests: Sequence[Tested], corrections: Sequence[Correction]
) -> list[TestGrade]:
    """The grades of all tests; those whose required tests are not passed earn only what staff give them."""
    done = {tested.grade.id: corrected(tested.grade, corrections) for tested in tests}
    for test in manifest.tests:
        missed = [done[name] for name in manifest.required(test) if done[name].status != "passed"]
        if missed and done[test.id].points > 0 and done[test.id].override is None:
            done[test.id] = _without(done[test.id], missed)
    return [*done.values()]


def _without(grade: TestGrade, missed: Sequence[TestGrade]) -> TestGrade:
    """A grade without points, because of the required tests that are not passed."""
    names = " and ".join("a hidden test" if each.hidden else each.id for each in missed)
    open_: Status = "error" if any(each.is_open for each in missed) else "failed"
    message = sentences.joined(f"It earns points only with all points in {names}.", grade.message)
    return grade.model_copy(update={"points": 0.0, "status": open_, "message": message})


def trouble(finished: Finished) -> str:
    """A sentence that explains why there is no result."""
    error = finished.error
    return str(error) if isinstance(error, GradingError) else f"It failed: {type(error).__name__}: {error}"


def _verdict(grades: Sequence[TestGrade]) -> GradeVerdict:
    if all(grade.is_open for grade in grades):
        return "not_comparable"
    if any(grade.status != "passed" for grade in grades if not grade.bonus):
        return "mismatch"
    return "match" if all(grade.verdict in {None, "match"} for grade in grades) else "noisy_match"


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
