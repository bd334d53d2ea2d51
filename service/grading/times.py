"""Tests of the kind `time`: compare CPU seconds with a budget."""

from __future__ import annotations

from collections.abc import Iterator

from schemas.grading.manifests import TimeTest
from service.grading import sentences
from service.grading.inputs import of_file
from service.grading.outcomes import Outcome
from service.grading.rendering import rendered
from service.grading.scales import margin_of, share_of
from service.grading.settings import Run


def time(test: TimeTest, run: Run) -> Iterator[Outcome]:
    """Grade the CPU seconds of a render of the submitted scene, as measured here."""
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
