"""The kinds of tests and the functions that run them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from schemas.grading.manifests import Criterion, ImageTest, RaysTest, SceneTest, TimeTest
from service.grading.comparing import image, scene
from service.grading.outcomes import Outcome, of_file
from service.grading.rays.ray_tests import rays
from service.grading.rendering import rendered
from service.grading.scales import by_number
from service.grading.settings import Run


def time(test: TimeTest, run: Run) -> Iterator[Outcome]:
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
    TimeTest: time,
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
