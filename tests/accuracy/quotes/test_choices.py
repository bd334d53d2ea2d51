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
    errors = (accuracy, None) if known else (None, UNKNOWN)
    return Fixed(
        Ladder(pattern, LIGHT, "single"), Timing(exactly(second), exactly(second)), *errors, workers=2
    )


def samples(quality: object) -> int:
    assert isinstance(quality, FixedQuality)
    assert quality.antialiasing is not None
    return quality.antialiasing.samples


@pytest.mark.parametrize(("pattern", "for_error", "for_seconds"), [("random", 44, 30), ("uniform", 49, 25)])
def test_count_is_one_that_the_pattern_allows(pattern: str, for_error: int, for_seconds: int) -> None:
    """The least that reaches an error, the greatest that fits a time."""
    cheap, fine = ladder(pattern).for_error(0.0151), ladder(pattern).for_seconds(15.0)
    assert cheap is not None
    assert fine is not None
    assert cheap.error is not None
    assert (samples(cheap.quality), samples(fine.quality)) == (for_error, for_seconds)
    assert cheap.error.estimate <= 0.0151
    assert fine.seconds.estimate <= 15.0


def test_offers_are_made_where_some_count_will_do() -> None:
    assert ladder("random").for_error(0.1 / 100) is None
    assert ladder("center").for_error(0.05) is None
    assert ladder("random").for_seconds(0.4) is None
    assert ladder("random", known=False).for_error(0.5) is None
    assert soonest([ladder("center")], 0.05) is None
    assert closest([ladder("random")], 0.4) is None
    offer = ladder("random", known=False).priced(4)
    assert (offer.error, offer.error_unknown) == (None, UNKNOWN)
    assert ladder("random").priced(4).error_unknown is None


def test_best_of_two_ladders_is_offered() -> None:
    slow, fast = ladder("random", second=2.0), ladder("stratified")
    offer = soonest([slow, fast], 0.02)
    assert offer is not None
    assert offer.quality == fast.ladder.quality(25)
    good, bad = ladder("sobol", error=0.01, second=4.0), ladder("random")
    offer = closest([bad, good], 10.0)
    assert offer is not None
    assert offer.quality == good.ladder.quality(5)


ADAPTIVE = Adaptive({0.02: (exactly(2.0), exactly(1.0)), 0.01: (exactly(6.0), exactly(4.0))}, "single")
POWER = Adaptive({0.04: (exactly(1.0), exactly(1.0)), 0.01: (exactly(4.0), exactly(4.0))}, "single")


@pytest.mark.parametrize(
    ("known", "error", "cost"),
    [
        (ADAPTIVE, 0.02, 2.0),
        (ADAPTIVE, 0.01, 6.0),
        (ADAPTIVE, 0.005, 24.0),
        (POWER, 0.02, 2.0),
        (POWER, 0.01, 4.0),
    ],
)
def test_target_costs_follow_those_measured(known: Adaptive, error: float, cost: float) -> None:
    """Half the smallest error costs four times as much; between two, costs follow a power law."""
    offer = known.priced(error)
    assert offer.cpu_seconds.estimate == pytest.approx(cost)
    assert offer.cpu_seconds.low <= cost <= offer.cpu_seconds.high
    assert (offer.cpu_seconds.high > offer.cpu_seconds.estimate) == (error not in known.points)
    assert offer.quality == TargetQuality(mode="target", error=error)


def test_larger_target_never_costs_more() -> None:
    seconds = [ADAPTIVE.priced(error).seconds.estimate for error in (0.2, 0.1, 0.05, 0.02)]
    assert seconds == sorted(seconds)
    measured = {0.02: 3.0, 0.01: 2.0, 0.005: 2.5, 0.002: 8.0}
    costs = ordered({error: exactly(cost) for error, cost in measured.items()})
    estimates = [costs[error].estimate for error in sorted(costs, reverse=True)]
    assert estimates == sorted(estimates)
    assert estimates[0] == pytest.approx((3.0 * 2.0) ** 0.5)
    assert (costs[0.005], costs[0.002]) == (exactly(2.5), exactly(8.0))
    assert all(costs[error].low <= cost <= costs[error].high for error, cost in measured.items())


def test_time_becomes_a_target_with_a_limit() -> None:
    offer = ADAPTIVE.for_seconds(16.0)
    assert offer is not None
    assert isinstance(offer.quality, TargetQuality)
    assert offer.quality.time_limit == 16.0
    assert 0.005 <= offer.quality.error < 0.0052
    assert offer.seconds.estimate <= 16.0 * (1 + 1e-9)
    assert ADAPTIVE.for_seconds(0.5) is None


def test_target_error_is_that_of_the_picture_rendered_whole() -> None:
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
