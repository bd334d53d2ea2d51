"""The cheapest setting for a requested error, and the best one for a given time."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import ceil, floor, log, log10

from accuracy.quotes.accuracies import Accuracy
from accuracy.quotes.settings import Ladder, target
from accuracy.quotes.timings import Timing
from accuracy.statistics import factor
from renderer.math.intervals import Interval
from schemas.api.plans import Offer, Predicted
from schemas.quality import CONFIDENCE, Quality

KEPT, LEAST = 0.7, 0.3
"""What the error of target quality comes to, over the one asked for, and the least of it that is usual, where
no picture near was rendered: it stops below, and how far below is chance."""

NEAR = 2.0
"""Most times by which a target may differ from that of a whole picture for its error to be known from it."""

FALLS = 2.0
"""Power of the error like which the seconds of target quality grow beyond what was tried: that of independent
samples."""

BETWEEN = 0.5
"""Standard deviation of that power."""

FINEST = 1e-6
"""Smallest error that target quality takes."""

AT_LIMIT = "The time limit may end the picture before its target error is reached."
"""Why the error of target quality is not known."""

FARTHEST = 0.1
"""Errors are offered down to this part of what was tried: beyond, nothing is known."""


@dataclass(frozen=True, slots=True)
class Fixed:
    """All that is known of a ladder.

    Attributes
    ----------
    ladder : Ladder
    timing : Timing
    accuracy : Accuracy or None
    unknown : str or None
        Why there is no accuracy.
    workers : int
    """

    ladder: Ladder
    timing: Timing
    accuracy: Accuracy | None
    unknown: str | None
    workers: int

    def priced(self, count: int) -> Offer:
        """One of its qualities."""
        cpu = self.timing.cpu_seconds(count)
        error = self.accuracy.error(count) if self.accuracy else None
        return _offer(self.ladder.quality(count), cpu, cpu.scaled(1 / self.workers), error, self.unknown)

    def for_error(self, error: float) -> Offer | None:
        """The least count whose error is predicted to be at most this."""
        count = self.ladder.at_least(self.accuracy.count(error)) if self.accuracy else None
        return None if count is None else self.priced(count)

    def for_seconds(self, seconds: float) -> Offer | None:
        """The greatest count that is predicted to fit."""
        first, later = self.timing.first.estimate, self.timing.later.estimate
        spare = seconds * self.workers - first
        if spare < 0:
            return None
        count = self.ladder.at_most(1 + spare / later if later else float("inf"))
        return None if count is None else self.priced(count)


@dataclass(frozen=True, slots=True)
class Adaptive:
    """All that is known of target quality.

    Attributes
    ----------
    points : dict of float to (Interval, Interval)
        By error, CPU seconds and seconds.
    precision : str
    confidence : float
        Share of pictures that are to keep their target.
    reached : dict of float to Interval
        The errors of the pictures that were rendered whole, by target.
    """

    points: dict[float, tuple[Interval, Interval]]
    precision: str
    confidence: float = CONFIDENCE
    reached: Mapping[float, Interval] = field(default_factory=dict)

    def errors(self, usual: Iterable[float]) -> set[float]:
        """Those that were tried, and the usual ones between them."""
        least, most = min(self.points, default=1.0), max(self.points, default=0.0)
        return {*self.points, *(error for error in usual if least < error < most)}

    def priced(self, error: float, limit: float | None = None) -> Offer:
        """Any error: between those that were tried, and beyond them, along a power of the error."""
        nearest = min(self.points, key=lambda known: abs(log(known / error)))
        apart = log(nearest / error)
        moved = factor(BETWEEN * abs(apart)).scaled((nearest / error) ** self._power(error))
        cpu, seconds = (known.times(moved) for known in self.points[nearest])
        reached: Interval | None = self._reached(error)
        if limit is not None:
            # Where the time limit ends the picture, its error by then is not known.
            reached = reached if seconds.estimate <= limit else None
            cpu, seconds = _limited(cpu, seconds, limit)
        return _offer(target(error, self.precision, limit, self.confidence), cpu, seconds, reached, AT_LIMIT)

    def _reached(self, error: float) -> Interval:
        """The error that a target leads to: as for the nearest picture rendered whole, else the usual one."""
        nearest = min(self.reached, key=lambda known: abs(log(known / error)), default=None)
        if nearest is None or abs(log(nearest / error)) > log(NEAR):
            return Interval(error * KEPT, error * LEAST, error)
        if nearest == error:
            return self.reached[nearest]
        # Another target is another picture: it may stop as far below as is usual, and no nearer than it may.
        found = self.reached[nearest].scaled(error / nearest)
        middle = min(found.estimate, error)
        return Interval(middle, min(found.low, middle, error * LEAST), max(error, middle))

    def _power(self, error: float) -> float:
        """Like which the seconds grow as the error falls."""
        errors = sorted(self.points)
        if error < errors[0]:
            return FALLS
        if len(errors) < 2:
            return 0.0
        finer = max((known for known in errors[:-1] if known <= error), default=errors[0])
        coarser = errors[errors.index(finer) + 1]
        costliest, cheapest = (self.points[known][0].estimate for known in (finer, coarser))
        return min(max(log(costliest / cheapest) / log(coarser / finer), 0.0), FALLS)

    def for_error(self, error: float) -> Offer | None:
        """What reaches an error."""
        return self.priced(error) if self.points else None

    def for_seconds(self, seconds: float) -> Offer | None:
        """The least error whose picture is predicted to fit, with the time as its limit."""
        fitting = [error for error, (_, known) in self.points.items() if known.estimate <= seconds]
        if not fitting:
            return None
        best = min(fitting)
        spare = seconds / self.points[best][1].estimate
        return self.priced(_rounded(best * max(spare ** (-1 / FALLS), FARTHEST)), seconds)


def ordered(costs: Mapping[float, Interval]) -> dict[float, Interval]:
    """Costs of target errors of which no finer one costs less.

    Neighbours in the wrong order take the mean of their logarithms (isotonic regression by pooling, Ayer et
    al. 1955): how far each was off by chance is not known.
    """
    pools: list[tuple[list[float], Interval]] = []
    for error in sorted(costs, reverse=True):
        pools.append(([error], costs[error]))
        while len(pools) > 1 and pools[-1][1].estimate < pools[-2][1].estimate:
            (finer, low), (coarser, high) = pools.pop(), pools.pop()
            pools.append((coarser + finer, _pooled(high, len(coarser), low, len(finer))))
    return {error: cost for errors, cost in pools for error in errors}


def _pooled(one: Interval, count: int, other: Interval, more: int) -> Interval:
    """The geometric mean of two costs that stand for so many errors, with an interval that holds both."""
    share = more / (count + more)
    middle = one.estimate ** (1 - share) * other.estimate**share
    return Interval(middle, min(one.low, other.low), max(one.high, other.high))


def _offer(
    quality: Quality, cpu: Interval, seconds: Interval, error: Interval | None, unknown: str | None
) -> Offer:
    return Offer(
        quality=quality,
        cpu_seconds=_predicted(cpu),
        seconds=_predicted(seconds),
        error=None if error is None else _predicted(error),
        error_unknown=unknown if error is None else None,
    )


def _predicted(known: Interval) -> Predicted:
    return Predicted(estimate=known.estimate, low=known.low, high=known.high)


def _limited(cpu: Interval, seconds: Interval, limit: float) -> tuple[Interval, Interval]:
    """CPU seconds and seconds of a picture that ends after so many seconds at most."""
    low, middle, high = (
        min(1.0, limit / end) if end else 1.0 for end in (seconds.low, seconds.estimate, seconds.high)
    )
    return (
        Interval(cpu.estimate * middle, cpu.low * low, cpu.high * high),
        Interval(seconds.estimate * middle, seconds.low * low, seconds.high * high),
    )


def _rounded(error: float) -> float:
    """Two digits, upwards."""
    step = 10.0 ** (floor(log10(error)) - 1)
    return max(float(f"{ceil(error / step) * step:.2g}"), FINEST)


def soonest(known: Iterable[Fixed | Adaptive], error: float) -> Offer | None:
    """What reaches an error in the least time."""
    offers = [offer for each in known if (offer := each.for_error(error))]
    return min(offers, key=lambda offer: offer.seconds.estimate, default=None)


def closest(known: Iterable[Fixed | Adaptive], seconds: float) -> Offer | None:
    """What comes closest to the converged picture in so many seconds."""
    offers = [
        (offer.error.estimate, offer)
        for each in known
        if (offer := each.for_seconds(seconds)) and offer.error
    ]
    return min(offers, key=lambda pair: pair[0], default=(0.0, None))[1]
