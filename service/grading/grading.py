"""Grade a submission: render references, run each test in its own process, and assemble the result."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from schemas.grading.grades import Grade, TestGrade
from schemas.grading.manifests import ImageTest, Manifest
from service.grading import results
from service.grading.adjustments import Correction
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder
from service.grading.kinds import findings
from service.grading.processes import MEBIBYTE, Errand, Finished, run_all
from service.grading.program_search import search
from service.grading.references import Prepared, prepare, wanted
from service.grading.settings import Run
from service.grading.variants import references_for

OnTest = Callable[[TestGrade], None]


@dataclass(frozen=True, slots=True)
class Graded:
    """A result and its pictures.

    Attributes
    ----------
    grade : Grade
    pictures : dict of str to bytes
        PNG files, by the names in the result.
    """

    grade: Grade
    pictures: dict[str, bytes]


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
    begun = time.perf_counter(), time.process_time(), datetime.now(UTC)
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
    in_order = [done[test.id] for test in manifest.tests]
    timings = results.timings(begun, cpu_seconds)
    whole = results.graded(
        manifest, in_order, timings, student=student, submitted=submitted, corrections=corrections
    )
    return Graded(whole, pictures_of(in_order))


def pictures_of(tests: Iterable[results.Tested]) -> dict[str, bytes]:
    """The pictures of all tests, by name."""
    return {name: content for tested in tests for name, content in tested.pictures.items()}


@contextmanager
def reference_folder(cache: Path | None) -> Iterator[Path]:
    """A folder for rendered references: the user's, or a temporary one."""
    if cache is not None:
        yield cache
        return
    with tempfile.TemporaryDirectory(prefix="penumbra-grade-") as folder:
        yield Path(folder)


def prepare_references(run: Run, jobs: int, folder: Path) -> tuple[dict[str, Prepared | str], float]:
    """Render all references that are scenes; also returns their CPU seconds."""
    errands = []
    for key, reference in wanted(run.manifest):
        deadline = run.manifest.deadline
        order = run.order(run.references, reference.file, reference.quality, deadline)
        errands.append(Errand(key, partial(prepare, order, folder), deadline, _bytes(run.manifest.memory)))
    prepared: dict[str, Prepared | str] = {}
    cpu_seconds = 0.0
    for key, finished in run_all(errands, jobs):
        prepared[key] = finished.result or results.trouble(finished)
        cpu_seconds += finished.cpu_seconds
    return prepared, cpu_seconds


def errands_of(run: Run, prefix: str = "") -> list[Errand]:
    """What leads to an outcome of each test, named by its id after the prefix."""
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
