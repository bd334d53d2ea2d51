"""The cheapest setting for an error, and the best one for a time."""

from __future__ import annotations

import pytest

from accuracy.quotes.accuracies import Accuracy
from accuracy.quotes.choices import Adaptive, Fixed, closest, ordered, soonest
from accuracy.quotes.settings import Ladder
from accuracy.quotes.timings import Timing
from renderer.math.intervals import Interval
from schemas.quality import FixedQuality, LightSampling, TargetQuality

UNKNOWN = "Too few pixels were sampled."
LIGHT = LightSampling(pattern="random", samples=4)


def exactly(value: float) -> Interval:
    return Interval(value, value, value)


def ladder(pattern: str, *, second: float = 1.0, error: float = 0.1, known: bool = True) -> Fixed:
    """Costs `second` a sample; its error is `error` over the root of the samples."""
    accuracy = Accuracy({1: exactly(error), 16: exactly(error / 4)}, power=0.5, unsure=0.0)
    timing = Timing(exactly(second), exactly(second))
    errors = (accuracy, None) if known else (None, UNKNOWN)
    return Fixed(Ladder(pattern, LIGHT, "single"), timing, *errors, workers=2)


def samples(quality: object) -> int:
    assert isinstance(quality, FixedQuality)
    assert quality.antialiasing is not None
    return quality.antialiasing.samples


@pytest.mark.parametrize(("pattern", "count"), [("random", 44), ("uniform", 49)])
def test_the_least_count_that_the_pattern_allows_reaches_the_error(pattern: str, count: int) -> None:
    offer = ladder(pattern).for_error(0.0151)
    assert offer is not None
    assert samples(offer.quality) == count
    assert offer.error is not None
    assert offer.error.estimate <= 0.0151


@pytest.mark.parametrize(("pattern", "count"), [("random", 30), ("uniform", 25), ("center", 1)])
def test_the_greatest_count_that_the_pattern_allows_fits_the_time(pattern: str, count: int) -> None:
    offer = ladder(pattern).for_seconds(15.0)
    assert offer is not None
    assert samples(offer.quality) == count
    assert offer.seconds.estimate <= 15.0


def test_what_no_count_can_do_is_not_offered() -> None:
    assert ladder("random").for_error(0.1 / 100) is None
    assert ladder("center").for_error(0.05) is None
    assert ladder("random").for_seconds(0.4) is None
    assert ladder("random", known=False).for_error(0.5) is None
    assert soonest([ladder("center")], 0.05) is None
    assert closest([ladder("random")], 0.4) is None


def test_an_offer_without_an_error_says_why() -> None:
    offer = ladder("random", known=False).priced(4)
    assert (offer.error, offer.error_unknown) == (None, UNKNOWN)
    assert ladder("random").priced(4).error_unknown is None


def test_the_faster_of_two_ladders_is_offered_for_an_error() -> None:
    slow, fast = ladder("random", second=2.0), ladder("stratified")
    offer = soonest([slow, fast], 0.02)
    assert offer is not None
    assert offer.quality == fast.ladder.quality(25)


def test_the_ladder_with_the_smaller_error_is_offered_for_a_time() -> None:
    good, bad = ladder("sobol", error=0.01, second=4.0), ladder("random")
    offer = closest([bad, good], 10.0)
    assert offer is not None
    assert offer.quality == good.ladder.quality(5)


ADAPTIVE = Adaptive({0.02: (exactly(2.0), exactly(1.0)), 0.01: (exactly(6.0), exactly(4.0))}, "single")


@pytest.mark.parametrize("error", [0.02, 0.01])
def test_errors_that_were_tried_cost_what_they_did(error: float) -> None:
    offer = ADAPTIVE.priced(error)
    for found, known in zip((offer.cpu_seconds, offer.seconds), ADAPTIVE.points[error], strict=True):
        assert found.model_dump() == known.document()
    assert offer.quality == TargetQuality(mode="target", error=error)


def test_half_the_smallest_error_that_was_tried_costs_four_times_as_much() -> None:
    assert ADAPTIVE.priced(0.005).cpu_seconds.estimate == pytest.approx(24.0)
    assert ADAPTIVE.priced(0.005).cpu_seconds.high > 24.0


def test_larger_errors_never_cost_more() -> None:
    seconds = [ADAPTIVE.priced(error).seconds.estimate for error in (0.2, 0.1, 0.05, 0.02)]
    assert seconds == sorted(seconds)


def test_a_time_becomes_an_error_that_fits_with_the_time_as_its_limit() -> None:
    offer = ADAPTIVE.for_seconds(16.0)
    assert offer is not None
    assert isinstance(offer.quality, TargetQuality)
    assert offer.quality.time_limit == 16.0
    assert 0.005 <= offer.quality.error < 0.0052
    assert offer.seconds.estimate <= 16.0 * (1 + 1e-9)
    assert ADAPTIVE.for_seconds(0.5) is None


def test_a_limit_bounds_the_price_and_leaves_the_error_unknown() -> None:
    offer = ADAPTIVE.priced(0.01, limit=1.0)
    assert offer.seconds.estimate == 1.0
    assert offer.cpu_seconds.estimate == pytest.approx(1.5)
    assert offer.error is None
    assert ADAPTIVE.priced(0.01, limit=5.0).error == ADAPTIVE.priced(0.01).error


def test_nothing_is_offered_where_nothing_was_tried() -> None:
    nothing = Adaptive({}, "double")
    assert nothing.for_error(0.1) is nothing.for_seconds(100.0) is None


def test_between_errors_that_were_tried_seconds_follow_the_power_that_joins_them() -> None:
    known = Adaptive({0.04: (exactly(1.0), exactly(1.0)), 0.01: (exactly(4.0), exactly(4.0))}, "single")
    assert known.priced(0.02).cpu_seconds.estimate == pytest.approx(2.0)
    assert known.priced(0.01).cpu_seconds.estimate == pytest.approx(4.0)


def test_usual_errors_are_offered_between_those_that_were_tried() -> None:
    known = Adaptive({0.04: (exactly(1.0), exactly(1.0)), 0.01: (exactly(4.0), exactly(4.0))}, "single")
    assert known.errors([0.1, 0.02, 0.001]) == {0.04, 0.02, 0.01}
    assert Adaptive({}, "single").errors([0.1, 0.02]) == set()


def test_finer_target_is_never_cheaper_than_a_coarser_one() -> None:
    """Costs that are in order stay as they are; the others meet between what was measured."""
    measured = {0.02: 3.0, 0.01: 2.0, 0.005: 2.5, 0.002: 8.0}
    costs = ordered({error: exactly(cost) for error, cost in measured.items()})
    estimates = [costs[error].estimate for error in sorted(costs, reverse=True)]
    assert estimates == sorted(estimates)
    assert estimates[0] == pytest.approx((3.0 * 2.0) ** 0.5)
    assert (costs[0.005], costs[0.002]) == (exactly(2.5), exactly(8.0))
    for error, cost in measured.items():
        assert costs[error].low <= cost <= costs[error].high


def test_error_of_a_target_is_that_of_the_picture_where_it_was_rendered_whole() -> None:
    """A picture without anything to refine is far better than its target asks for."""
    whole = Interval(0.002, 0.0015, 0.003)
    known = Adaptive(ADAPTIVE.points, "single", reached={0.02: whole})
    exact, near, far = (known.priced(error).error for error in (0.02, 0.03, 0.001))
    assert exact is not None
    assert near is not None
    assert far == ADAPTIVE.priced(0.001).error
    assert (exact.estimate, exact.low, exact.high) == (0.002, 0.0015, 0.003)
    assert near.estimate == pytest.approx(0.003)
    assert near.low <= near.estimate <= near.high == 0.03
