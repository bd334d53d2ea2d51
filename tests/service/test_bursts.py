"""A burst of jobs by many users: each is accepted or refused with Retry-After, and none is lost."""

from __future__ import annotations

import pytest

from benchmarks.bursts import burst, scene


@pytest.mark.slow
def test_a_burst_beyond_the_queue_is_refused_in_part_and_nothing_is_lost() -> None:
    found = burst(10, 3, scene, workers=2, max_queued_jobs=8)
    assert (found["jobs"], found["users"], found["lost"]) == (30, 10, 0)
    # Ten users send at once, and eight jobs fit.
    assert found["refusals"] > 0


@pytest.mark.slow
def test_a_burst_of_one_picture_is_rendered_once() -> None:
    found = burst(10, 3, lambda _: scene(0), workers=2)
    assert (found["jobs"], found["lost"], found["refusals"]) == (30, 0, 0)
