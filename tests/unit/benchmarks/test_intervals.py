import json

import pytest

from benchmarks import intervals


def test_the_kept_intervals_are_those_that_pictures_report() -> None:
    """A hundredth, as processors round sums differently."""
    kept = json.loads(intervals.KEPT.read_text())
    assert [found["seed"] for found in kept["pictures"]] == [*intervals.SEEDS]
    first = kept["pictures"][0]
    reported = intervals.rendered(first["seed"]).report["error"]
    assert {name: 255 * reported[name] for name in ("estimate", "low", "high")} == pytest.approx(
        {name: first[name] for name in ("estimate", "low", "high")}, rel=0.01
    )
