"""The kinds of tests and the functions that run them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from schemas.grading.manifests import Criterion, ImageTest, RaysTest, SceneTest, TimeTest
from service.grading.comparing import image, scene
from service.grading.outcomes import Outcome
from service.grading.rays import rays
from service.grading.settings import Run
from service.grading.times import time

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
