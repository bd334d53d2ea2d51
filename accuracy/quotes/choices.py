"""The cheapest setting for a requested error, and the best one for a given time."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import log

from accuracy.quotes.accuracies import Accuracy
from accuracy.quotes.rehearsals import Rehearsal
from accuracy.quotes.settings import MIN_ERROR, Ladder, target
from accuracy.quotes.timings import Stopwatch
from accuracy.statistics import factor
from renderer.math.intervals import Interval
from schemas.api.plans import Offer, Predicted
from schemas.quality import CONFIDENCE, Quality

USUAL_ERROR_SHARE, LEAST_ERROR_SHARE = 0.7, 0.3
"""Usual and least ratio of the final error to the target: by chance it ends lower. A completed picture may
end far below."""

SECONDS_POWER, POWER_DEVIATION = 1.0, 0.5
"""The seconds of target quality grow like this power of the error beyond the errors tried; with its standard
deviation. It is 0.7 between 4/255 and 1/255 in pictures of 96 to 320 pixels, 2 at the finest errors."""

ROUGH_INTERVAL_RATIO = 5.0
"""Ratio of the ends of a cost's interval above which it is a rough guess."""

AT_LIMIT = "The time limit may end the picture before its target error is reached."
"""Reason for an unknown error of target quality."""

CANNOT_TELL = "There was no time to render enough of the picture: its cost is a rough guess."


@dataclass(frozen=True, slots=True)
class Fixed:
    """Prices of a ladder; `unknown` says why there is no accuracy."""

    ladder: Ladder
    timing: Stopwatch
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
        accuracy, allowed = self.accuracy, self.ladder.allowed
        if accuracy is None:
            return None
        at = bisect_left(allowed, -error, key=lambda count: -accuracy.error(count).estimate)
        return self.priced(allowed[at]) if at < len(allowed) else None

    def for_seconds(self, seconds: float) -> Offer | None:
        """The greatest count that is predicted to fit."""
        allowed, limit = self.ladder.allowed, seconds * self.workers
        at = bisect_right(allowed, limit, key=lambda count: self.timing.cpu_seconds(count).estimate)
        return self.priced(allowed[at - 1]) if at else None


@dataclass(frozen=True, slots=True)
class Adaptive:
    """Prices of target quality.

    Attributes
    ----------
    tried : dict of float to Rehearsal
        By target error.
    precision : str
    workers : int
    confidence : float
        Share of pictures that must keep their target.
    """

    tried: Mapping[float, Rehearsal]
    precision: str
    workers: int
    confidence: float = CONFIDENCE

    def priced(self, error: float, limit: float | None = None) -> Offer:
        """The price of any error, interpolated and extrapolated from those tried by a power of the error."""
        nearest = min(self.tried, key=lambda known: abs(log(known / error)))
        apart = log(nearest / error)
        moved = factor(POWER_DEVIATION * abs(apart)).scaled((nearest / error) ** self._power(error))
        cpu = self.tried[nearest].cpu_seconds.times(moved)
        seconds = cpu.scaled(1 / self.workers)
        reached = self.tried[error].reached if error in self.tried else None
        reached = reached or Interval(error * USUAL_ERROR_SHARE, error * LEAST_ERROR_SHARE, error)
        if limit is not None:
            # If the time limit ends the picture, its error is not known.
            reached = reached if seconds.estimate <= limit else None
            cpu, seconds = _limited(cpu, limit * self.workers), _limited(seconds, limit)
        return _offer(target(error, self.precision, limit, self.confidence), cpu, seconds, reached, AT_LIMIT)

    def _power(self, error: float) -> float:
        """Power of the error by which the seconds grow."""
        finer = max((known for known in self.tried if known <= error), default=None)
        coarser = min((known for known in self.tried if known >= error), default=None)
        if finer is None:
            return SECONDS_POWER
        if coarser is None or finer == coarser:
            return 0.0
        costliest, cheapest = (self.tried[known].cpu_seconds.estimate for known in (finer, coarser))
        return max(log(costliest / cheapest) / log(coarser / finer), 0.0)

    def for_error(self, error: float) -> Offer | None:
        """Cheapest offer with at most an error, None if there is none."""
        return self.priced(error) if self.tried else None

    def for_seconds(self, seconds: float) -> Offer | None:
        """The least error whose picture is predicted to fit, with the time as its limit."""
        limit = seconds * self.workers
        costs = {error: found.cpu_seconds.estimate for error, found in self.tried.items()}
        best = min((error for error, cost in costs.items() if cost <= limit), default=None)
        if best is None:
            return None
        error = best * (costs[best] / limit) ** (1 / SECONDS_POWER)
        return self.priced(max(float(f"{error:.2g}"), MIN_ERROR), seconds)


def _offer(
    quality: Quality, cpu: Interval, seconds: Interval, error: Interval | None, unknown: str | None
) -> Offer:
    return Offer(
        quality=quality,
        cpu_seconds=_predicted(cpu),
        seconds=_predicted(seconds),
        error=None if error is None else _predicted(error),
        error_unknown=unknown if error is None else None,
        rough=CANNOT_TELL if cpu.high > ROUGH_INTERVAL_RATIO * cpu.low else None,
    )


def _predicted(known: Interval) -> Predicted:
    return Predicted(estimate=known.estimate, low=known.low, high=known.high)


def _limited(known: Interval, limit: float) -> Interval:
    """Price of a picture that ends at a time limit."""
    return Interval(*(min(each, limit) for each in (known.estimate, known.low, known.high)))


def soonest(known: Iterable[Fixed | Adaptive], error: float) -> Offer | None:
    """Fastest offer with at most an error."""
    offers = [offer for each in known if (offer := each.for_error(error))]
    return min(offers, key=lambda offer: offer.seconds.estimate, default=None)


def closest(known: Iterable[Fixed | Adaptive], seconds: float) -> Offer | None:
    """Offer with the least error within a number of seconds."""
    offers = [
        (offer.error.estimate, offer)
        for each in known
        if (offer := each.for_seconds(seconds)) and offer.error
    ]
    return min(offers, key=lambda pair: pair[0], default=(0.0, None))[1]
