"""The cheapest setting for an error, and the best one for a time."""

from functools import cache

import pytest

import renderer
from accuracy.quotes.accuracies import Accuracy
from accuracy.quotes.choices import Adaptive, Fixed, closest, soonest
from accuracy.quotes.rehearsals import Rehearsal
from accuracy.quotes.settings import Ladder
from accuracy.quotes.timings import Stopwatch
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan
from schemas.quality import FixedQuality, LightSampling, TargetQuality
from tests.accuracy.quotes.conftest import edge

UNKNOWN = "Too few pixels were sampled."
LIGHT = LightSampling(pattern="random", samples=4)


def exactly(value: float) -> Interval:
    return Interval(value, value, value)


@cache
def plan() -> RenderPlan:
    return renderer.compile_scene(edge(10, 10))


def ladder(pattern: str, *, second: float = 1.0, error: float = 0.1, known: bool = True) -> Fixed:
    """Costs `second` a sample; its error is `error` over the root of the samples."""
    accuracy = Accuracy({count: exactly(error / count**0.5) for count in range(1, 4097)})
    errors = (accuracy, None) if known else (None, UNKNOWN)
    timing = Stopwatch(plan(), {1: [(second, 100)]})
    return Fixed(Ladder(pattern, LIGHT, "single"), timing, *errors, workers=2)


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


def tried(**costs: float) -> Adaptive:
    """Target errors in thousandths that were tried, and their CPU seconds."""
    found = {int(name[1:]) / 1000: Rehearsal(exactly(cost)) for name, cost in costs.items()}
    return Adaptive(found, "single", workers=2)


ADAPTIVE, POWER = tried(e20=2.0, e10=8.0), tried(e40=1.0, e10=4.0)


@pytest.mark.parametrize(
    ("known", "error", "cost"),
    [(ADAPTIVE, 0.02, 2.0), (ADAPTIVE, 0.01, 8.0), (POWER, 0.02, 2.0), (POWER, 0.01, 4.0)],
)
def test_target_costs_follow_those_measured(known: Adaptive, error: float, cost: float) -> None:
    """Between two, costs follow a power law."""
    offer = known.priced(error)
    assert offer.cpu_seconds.estimate == pytest.approx(cost)
    assert offer.seconds.estimate == pytest.approx(cost / 2)
    assert offer.cpu_seconds.low <= offer.cpu_seconds.estimate <= offer.cpu_seconds.high
    assert (offer.cpu_seconds.high > offer.cpu_seconds.estimate) == (error not in known.tried)
    assert offer.quality == TargetQuality(mode="target", error=error)


def test_larger_target_never_costs_more() -> None:
    for known in (ADAPTIVE, tried(e20=3.0, e10=2.0)):
        seconds = [known.priced(error).seconds.estimate for error in (0.2, 0.1, 0.05, 0.02)]
        assert seconds == sorted(seconds)
    assert ADAPTIVE.priced(0.001).seconds.estimate > ADAPTIVE.priced(0.01).seconds.estimate


def test_cost_that_cannot_be_told_says_so() -> None:
    assert ADAPTIVE.priced(0.01).rough is None
    for spread, said in ((1.5, False), (3.0, True)):
        found = Rehearsal(Interval(1.0, 1 / spread, spread))
        assert (Adaptive({0.01: found}, "single", 1).priced(0.01).rough is not None) == said


def test_time_becomes_a_target_with_a_limit() -> None:
    offer = ADAPTIVE.for_seconds(16.0)
    assert offer is not None
    assert isinstance(offer.quality, TargetQuality)
    assert offer.quality.time_limit == 16.0
    assert offer.quality.error < 0.01
    assert offer.seconds.estimate <= offer.seconds.high <= 16.0
    assert ADAPTIVE.for_seconds(0.5) is None


def test_target_error_is_that_of_the_picture_rendered_whole() -> None:
    """A picture without anything to refine is far better than its target asks for."""
    whole = Interval(0.002, 0.0015, 0.003)
    error = Adaptive({0.02: Rehearsal(exactly(1.0), whole)}, "single", 1).priced(0.02).error
    assert error is not None
    assert (error.estimate, error.low, error.high) == (0.002, 0.0015, 0.003)
    guess = ADAPTIVE.priced(0.001).error
    assert guess is not None
    assert guess.low < guess.estimate < guess.high == 0.001
