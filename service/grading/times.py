"""Tests of the kind `time`: compare CPU seconds with a budget."""

from __future__ import annotations

import math
from collections.abc import Iterator

from schemas.errors import SceneError
from schemas.grading.manifests import ReportFile, TimeTest
from schemas.limits import limits_in_force
from schemas.pointers import tokens
from schemas.reading.documents import read_text
from service.grading import sentences
from service.grading.errors import NotGradableError
from service.grading.inputs import of_file
from service.grading.outcomes import Outcome
from service.grading.rendering import rendered
from service.grading.scales import margin_of, share_of
from service.grading.settings import Run


def time(test: TimeTest, run: Run) -> Iterator[Outcome]:
    """Grade the CPU seconds of a render, or those that the submission reports."""
    if isinstance(test.submitted, ReportFile):
        seconds = _reported(test.submitted, run)
    else:
        seconds = rendered(run.submitted(test.submitted, test)).cpu_seconds
    content = run.submission.read(test.submitted.file)
    yield Outcome(
        share=share_of(seconds, test.accept),
        message=sentences.held("cpu_seconds", seconds, test.accept),
        metric="cpu_seconds",
        value=seconds,
        threshold=test.accept.full,
        margin=margin_of(seconds, test.accept),
        metrics={"cpu_seconds": seconds},
        inputs=(of_file(test.id, "submission", test.submitted.file, content),),
    )


def _reported(report: ReportFile, run: Run) -> float:
    try:
        document = read_text(run.submission.read(report.file), limits_in_force())
    except SceneError as error:
        raise NotGradableError(f"{report.file} is not a JSON file. {error}") from error
    value = _at(document.content, report.pointer)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < 0:
        raise NotGradableError(
            f"{report.file} has no number of seconds at {report.pointer}. Write one there."
        )
    return float(value)


def _at(content: object, pointer: str) -> object:
    for name in tokens(pointer):
        if isinstance(content, dict):
            content = content.get(name)
        elif isinstance(content, list) and name.isdecimal() and int(name) < len(content):
            content = content[int(name)]
        else:
            return None
    return content
