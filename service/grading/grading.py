"""Grade a submission: render references, run each test in its own process, and assemble the result."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from schemas.grading.grades import Grade, GradeTimings, TestGrade
from schemas.grading.manifests import Criterion, ImageTest, Manifest, RaysTest, SceneTest, TimeTest
from service.grading import results
from service.grading.adjustments import Correction
from service.grading.comparing import image, scene
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder
from service.grading.likeness.fingerprints import Fingerprint
from service.grading.outcomes import Outcome, by_number, of_file
from service.grading.processes import MEBIBYTE, Errand, Finished, run_all
from service.grading.programs.program_search import search
from service.grading.rays.ray_tests import rays
from service.grading.references import prepare, to_render
from service.grading.rendering import rendered
from service.grading.settings import Run
from service.grading.variants import references_for

OnTest = Callable[[TestGrade], None]


@dataclass(frozen=True, slots=True)
class Graded:
    """The result of a submission.

    Attributes
    ----------
    pictures : dict of str to bytes
        PNG files, by the names in the grade.
    prints : dict of str to Fingerprint
        Of the submitted pictures, by test.
    """

    grade: Grade
    pictures: dict[str, bytes]
    prints: dict[str, Fingerprint]


def grade(  # noqa: PLR0913 - one argument for each option of the command
    manifest: Manifest,
    *,
    references: Path,
    submission: Path,
    jobs: int = 1,
    server: str | None = None,
    cache: Path | None = None,
    pictures: bool = False,
    student: str | None = None,
    submitted: str | None = None,
    corrections: Sequence[Correction] = (),
    on_test: OnTest | None = None,
) -> Graded:
    """Grade a submission by the tests of a manifest.

    Parameters
    ----------
    references, submission
        Folders of the manifest and of the submission; no file outside of them is opened.
    jobs
        Number of tests that run at the same time.
    server
        The service that renders; by default, this machine.
    cache
        A folder that keeps rendered references for later runs.
    pictures
        Whether to make pictures of the differences.
    student, submitted
        Name of the student and time of the submission (ISO 8601), for the result and policies of the
        manifest.
    corrections
        Points that staff give this submission.
    on_test
        Called with each test as soon as it finishes.

    Notes
    -----
    Call this under ``if __name__ == "__main__":``, as always with multiprocessing.
    """
    begun, cpu_before, started = time.perf_counter(), time.process_time(), datetime.now(UTC)
    run = Run(
        manifest,
        references_for(manifest, references, student),
        Folder(submission.resolve(), "submission"),
        server,
        pictures,
    )
    tests = {test.id: test for test in manifest.tests}
    with reference_folder(cache) as folder:
        prepared, cpu_seconds = prepare_references(run, jobs, folder)
        done = dict[str, results.Tested]()
        for test_id, finished in run_all(errands_of(replace(run, prepared=prepared)), jobs):
            done[test_id] = tested = results.tested(tests[test_id], finished)
            cpu_seconds += finished.cpu_seconds
            if on_test is not None:
                on_test(tested.grade)
    timings = GradeTimings(
        seconds=time.perf_counter() - begun,
        cpu_seconds=time.process_time() - cpu_before + cpu_seconds,
        started=started.isoformat(timespec="seconds"),
    )
    return assembled(manifest, done, timings, student, submitted, corrections)


def assembled(
    manifest: Manifest,
    done: Mapping[str, results.Tested],
    timings: GradeTimings,
    student: str | None,
    submitted: str | None,
    corrections: Sequence[Correction],
) -> Graded:
    """The result of a submission from those of all its tests, by id."""
    tests = [done[test.id] for test in manifest.tests]
    return Graded(
        results.graded(
            manifest, tests, timings, student=student, submitted=submitted, corrections=corrections
        ),
        {name: content for tested in tests for name, content in tested.outcome.pictures.items()},
        {
            tested.grade.id: tested.outcome.fingerprint
            for tested in tests
            if tested.outcome.fingerprint is not None
        },
    )


@contextmanager
def reference_folder(cache: Path | None) -> Iterator[Path]:
    """A folder for rendered references: the user's, or a temporary one."""
    if cache is not None:
        yield cache
        return
    with tempfile.TemporaryDirectory(prefix="penumbra-grade-") as folder:
        yield Path(folder)


def prepare_references(run: Run, jobs: int, folder: Path) -> tuple[dict[str, Path | str], float]:
    """Render all references that are scenes; also returns their CPU seconds."""
    errands = []
    for key, reference in to_render(run.manifest).items():
        deadline = run.manifest.deadline
        order = run.order(run.references, reference.file, reference.quality, deadline)
        errands.append(Errand(key, partial(prepare, order, folder), deadline, _bytes(run.manifest.memory)))
    prepared: dict[str, Path | str] = {}
    cpu_seconds = 0.0
    for key, finished in run_all(errands, jobs):
        prepared[key] = finished.result or results.trouble(finished)
        cpu_seconds += finished.cpu_seconds
    return prepared, cpu_seconds


def errands_of(run: Run, prefix: str = "") -> list[Errand]:
    """Errands that lead to an outcome of each test, named by its id after the prefix."""
    if not run.manifest.charged_once:
        return _tests(run, prefix)
    memory = _bytes(run.manifest.memory)
    then = partial(_judged, run, prefix)
    return [Errand(f"{prefix}search", partial(search, run), run.manifest.deadline, memory, then)]


def _judged(run: Run, prefix: str, searched: Finished) -> list[Errand]:
    """The tests, once the mistakes of the program are known; if they are not, its pictures are left open."""
    if searched.result is None:
        first, *others = _tests(run, prefix, results.trouble(searched))
    else:
        first, *others = _tests(replace(run, mistakes=searched.result), prefix)
    return [replace(first, cpu_seconds=searched.cpu_seconds), *others]


def _tests(run: Run, prefix: str, unknown: str = "") -> list[Errand]:
    """All tests; those of pictures break with the reason why mistakes of the program are `unknown`."""
    return [
        Errand(
            prefix + test.id,
            partial(_broken, unknown)
            if unknown and isinstance(test, ImageTest)
            else partial(findings, test, run),
            run.deadline(test),
            _bytes(test.memory or run.manifest.memory),
        )
        for test in run.manifest.tests
    ]


def _broken(reason: str) -> None:
    raise BrokenTestError(
        f"The search for mistakes of the whole program gave no result: {reason} Grade again, with a longer "
        "'deadline' in the manifest if it was late."
    )


def _bytes(mebibytes: int | None) -> int | None:
    return None if mebibytes is None else mebibytes * MEBIBYTE


def time_used(test: TimeTest, run: Run) -> Iterator[Outcome]:
    """Grade the CPU seconds of a render of the submitted scene, as measured here."""
    seconds = rendered(run.submitted(test.submitted, test)).cpu_seconds
    content = run.submission.read(test.submitted.file)
    yield replace(
        by_number("cpu_seconds", seconds, test.accept),
        metrics={"cpu_seconds": seconds},
        inputs=(of_file(test.id, "submission", test.submitted.file, content),),
    )


KINDS: dict[type[Criterion], Callable[[Any, Run], Iterator[Outcome]]] = {
    ImageTest: image,
    SceneTest: scene,
    RaysTest: rays,
    TimeTest: time_used,
}
"""The function that runs each kind of test. Each outcome it yields replaces the previous one."""


def findings(test: Criterion, run: Run) -> Iterator[Outcome]:
    """Run one test in this process, and yield its outcomes as soon as they are known.

    Raises
    ------
    GradingError
        The test has no result; the message says why.
    """
    return KINDS[type(test)](test, run)
