"""A short run of the fuzzer: the long one is ``python -m benchmarks.fuzz``."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks import fuzz
from benchmarks.fuzz_bodies import Bodies
from schemas.api.jobs import JobRequest
from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.reading import read_document


@given(source=st.randoms(use_true_random=False))
@settings(max_examples=200, suppress_health_check=list(HealthCheck))
def test_a_document_is_read_or_refused_and_nothing_else(source: random.Random) -> None:
    with contextlib.suppress(SceneError):
        read_document(Bodies(source).job(), JobRequest, limits=Limits(max_body_bytes=200_000))


@pytest.mark.slow
def test_no_body_is_answered_by_an_error_of_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answers = fuzz.Answers()
    asyncio.run(fuzz.bulk(tmp_path, 480, 2026, time.monotonic() + 300, answers))
    assert answers.total == 480
    assert answers.broken == []
    # Not everything is refused: some requests of each kind are accepted.
    taken = {route for route, counts in answers.by_route.items() if counts[200] + counts[202]}
    assert taken >= {"plans", "jobs", "assets", "traces"}


def test_a_broken_promise_is_reported_with_the_body_that_broke_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answers = fuzz.Answers()
    answers.count(fuzz.Sent("plans", "POST", "/v1/plans", b"{}"), 422)
    answers.count(fuzz.Sent("plans", "POST", "/v1/plans", b"[]"), 503)
    reported = fuzz.document(fuzz.Outcome(answers, 0, 1.0, 100.0, 101.0), 2, 1)
    assert [promise["held"] for promise in reported["promises"]] == [False, True]
    (name,) = reported["promises"][0]["details"]["broken"]
    assert (tmp_path / "out" / "fuzz" / name).read_bytes() == b"[]"
    assert json.loads(json.dumps(reported))["machine"]
