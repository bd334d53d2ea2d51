"""How the cost grows, of the right pictures."""

from __future__ import annotations

import pytest

from benchmarks.scaling import LONG, TARGET, curve, fixed, name_of, plan_of, repeated, shared
from schemas.quality import Quality


@pytest.mark.parametrize(("each", "runs", "count"), [(0.0, 5, 5), (LONG / 2, 5, 2), (2 * LONG, 5, 1)])
def test_what_takes_long_is_timed_less_often(each: float, runs: int, count: int) -> None:
    assert repeated(lambda: each, runs) == [each] * count


@pytest.mark.parametrize("quality", [fixed(4, 2), TARGET])
def test_pictures_have_the_size_and_the_quality_of_their_curve(quality: Quality) -> None:
    plan = plan_of("chess", quality, 24)
    assert max(plan.width, plan.height) == 24
    assert plan.quality == quality


def test_a_curve_has_a_point_for_each_size_and_a_power_from_the_second_on() -> None:
    found = list(curve("pixels", "soft", ((side, plan_of("soft", TARGET, side)) for side in (8, 16)), 2))
    assert [(point["over"], point["picture"], point["size"]) for point in found] == [
        ("pixels", "soft", 8),
        ("pixels", "soft", 16),
    ]
    assert [point["power"] is None for point in found] == [True, False]
    assert all(point["cpu_seconds"]["runs"] == 2 for point in found)


def test_workers_are_compared_on_the_same_picture() -> None:
    found = shared("soft", fixed(1, 1), 8, 1)
    assert found["picture"] == name_of("soft", fixed(1, 1)) == "soft, 1 x 1"
    # Each of the three is rounded by itself.
    assert found["ratio"] == pytest.approx(found["one"]["median"] / found["two"]["median"], abs=0.01)
