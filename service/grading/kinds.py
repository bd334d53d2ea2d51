"""The table of the kinds of tests."""

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
"""What finds out about each kind of test. Of several outcomes each takes the place of the one before."""


def findings(test: Criterion, run: Run) -> Iterator[Outcome]:
    """Run one test in this process, and give what it has found as soon as that is known.

    Raises
    ------
    GradingError
        There is no answer; the message says why.
    """
    return KINDS[type(test)](test, run)
