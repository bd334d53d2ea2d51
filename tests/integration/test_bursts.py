"""A burst of jobs by many users: all are accepted or asked to return later, and none is lost."""

from __future__ import annotations

import pytest

from benchmarks.bursts import burst, scene


@pytest.mark.slow
def test_a_burst_beyond_the_queue_is_asked_to_return_and_nothing_is_lost() -> None:
    reported = burst(10, 3, scene, workers=2, max_queued_jobs=8)
    assert (reported["jobs"], reported["users"], reported["lost"]) == (30, 10, 0)
    # Ten users send at once, and eight jobs fit.
    assert reported["told_to_return"] > 0


@pytest.mark.slow
def test_a_burst_of_one_picture_is_rendered_once() -> None:
    reported = burst(10, 3, lambda _: scene(0), workers=2)
    assert (reported["jobs"], reported["lost"], reported["told_to_return"]) == (30, 0, 0)
