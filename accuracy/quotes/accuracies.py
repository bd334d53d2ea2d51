"""Errors of fixed qualities, from pixels that are sampled twice.

Two independent sets of samples of a pixel, a and b, are both right in the mean. So the mean over pixels of
(u - a) (u - b) is the squared error of any other samples u, whatever the errors of a and b are; and half of
that of (a - b)^2 is the squared error of a itself.
"""

from collections import Counter
from dataclasses import dataclass, field
from functools import partial
from math import exp, hypot, inf, log

import numpy as np

from accuracy.quotes import places
from accuracy.quotes.deadlines import Deadline, within
from accuracy.quotes.settings import MEASURED
from accuracy.statistics import clipped, factor, line, mean
from renderer.integrator import camera_rays, radiance
from renderer.math.arrays import Floats
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan
from renderer.tiling import Block
from schemas.tiles import Pass, Tile

SAMPLES = 16
"""Of each of the two sets: as many as the greatest count whose error is measured."""

USUAL, UNUSUAL = 1.25, 0.5
"""Power of the number of samples that squared errors fall by, and its standard deviation over patterns and
pictures: 1 where samples are independent, 3/2 where they are well spread over edges."""

BLOCKS_DIFFER = 1.5
"""Relative standard deviation that is usual between squared errors in blocks of a picture: some have no
edge."""

UNIT = 0.04
"""Seconds that sampling a block shall take at most."""

FEWEST = 2
"""Blocks below which nothing is said about errors."""

FEWEST_PIXELS = 256
"""Pixels below which nothing is said about errors, unless they are from all over the picture.

Most of an error is in few pixels, at edges. In pictures of the gallery the intervals of 256 pixels held the
error in nine of ten tries, those of 128 in eight, and those of 64 in seven, with estimates as low as a tenth.
"""

TOO_FEW = "Only {pixels} pixels were sampled, too few to estimate an error: edges may lie between them."
AS_ZERO = "In the {pixels} pixels that were sampled the error cannot be distinguished from zero."


class UnknownAccuracyError(Exception):
    """The sampled pixels say nothing about errors; the message is why."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Errors of a ladder by counts.

    Attributes
    ----------
    known : dict of int to Interval
        Root mean square errors at the counts where they were measured, in rising order.
    power : float
        By which the error falls with the count beyond these.
    unsure : float
        Standard deviation of the power.
    """

    known: dict[int, Interval]
    power: float
    unsure: float

    def error(self, count: float) -> Interval:
        """The error at any count: that of the nearest measured one, moved along the law."""
        nearest = min(self.known, key=lambda known: abs(log(known / count)))
        apart = log(count / nearest)
        return self.known[nearest].scaled(exp(-self.power * apart)).times(factor(self.unsure * abs(apart)))

    def count(self, error: float) -> float:
        """How many samples bring the error down to this, not rounded; inf if none do."""
        enough = [count for count, reached in self.known.items() if reached.estimate <= error]
        nearest = min(enough, default=max(self.known))
        if self.power <= 0:
            return float(nearest) if enough else inf
        # Fewer than enough may do, if not so few as are known not to.
        least = max((count for count in self.known if count < nearest), default=1)
        count = nearest * (self.known[nearest].estimate / error) ** (1 / self.power)
        return float(max(count, least))


@dataclass(slots=True)
class Sampled:
    """Errors that pixels in blocks all over the picture have shown.

    Attributes
    ----------
    plans : list of dict of int to RenderPlan
        For each ladder but the last the plans of the counts to be measured.
    halves : pair of RenderPlan
        Plans of the two sets: the last ladder with two seeds.
    squares : list of dict of int to list of float
        For each ladder and count the mean squared error in each block.
    weights : list of int
        Pixels that each block stands for.
    pixels : int
        How many were sampled.
    """

    plans: list[dict[int, RenderPlan]]
    halves: tuple[RenderPlan, RenderPlan]
    squares: list[dict[int, list[float]]] = field(default_factory=list)
    weights: list[int] = field(default_factory=list)
    pixels: int = 0

    def run(self, deadline: Deadline, ray_seconds: float) -> None:
        """Sample pixels until the deadline, or in all blocks there are."""
        self.squares = [{count: [] for count in plans} for plans in self.plans]
        self.squares.append({count: [] for count in MEASURED})
        plan = self.halves[0]
        cells = places.cells(plan.width, plan.height, self._side(ray_seconds), plan.seed)
        for _ in within(deadline, (partial(self._block, cell) for cell in cells)):
            pass

    def _side(self, ray_seconds: float) -> int:
        rays = 2 * SAMPLES + sum(map(sum, self.plans))
        side = places.SIDE
        while side > places.SMALL and (side / places.APART) ** 2 * rays * ray_seconds > UNIT:
            side //= 2
        return side

    def _block(self, cell: Tile) -> None:
        block = places.scattered(cell, self.halves[0].seed)
        one, other = (_samples(plan, block, SAMPLES) for plan in self.halves)
        a, b = _shown(one, SAMPLES), _shown(other, SAMPLES)
        own = float(np.mean((a - b) ** 2)) / 2
        for count, squares in self.squares[-1].items():
            few = float(np.mean((_shown(one, count) - b) ** 2)) - own
            squares.append(own if count == SAMPLES else few)
        for plans, found in zip(self.plans, self.squares, strict=False):
            for count, plan in plans.items():
                u = _shown(_samples(plan, block, count), count)
                found[count].append(float(np.mean((u - a) * (u - b))))
        self.pixels += block.columns.size
        self.weights.append(cell.width * cell.height)

    def accuracy(self, number: int) -> Accuracy:
        """Errors of a ladder, the last of which is that of the two sets.

        Raises
        ------
        UnknownAccuracyError
            If too few pixels were sampled, or they show no error that differs from zero.
        """
        if len(self.weights) < FEWEST or not (self.pixels >= FEWEST_PIXELS or self._is_whole):
            raise UnknownAccuracyError(TOO_FEW.format(pixels=self.pixels))
        squares = self.squares[number]
        known = {count: self._mean(found) for count, found in squares.items() if self._shows_error(found)}
        if not known:
            raise UnknownAccuracyError(AS_ZERO.format(pixels=self.pixels))
        power, unsure = _law({count: found.estimate for count, found in known.items()})
        return Accuracy({count: found.root() for count, found in known.items()}, power / 2, unsure / 2)

    @property
    def _is_whole(self) -> bool:
        """Whether pixels from all over the picture were sampled."""
        return sum(self.weights) >= self.halves[0].width * self.halves[0].height

    def _shows_error(self, squares: list[float]) -> bool:
        """Whether squared errors say how large an error is: chance may bring estimates of them below zero.

        Where nothing differs anywhere, as in a picture of the background alone, there is no error.
        """
        return self._mean(squares).estimate > 0 or (self._is_whole and not any(squares))

    def _mean(self, squares: list[float]) -> Interval:
        total = self.halves[0].width * self.halves[0].height
        weights = np.array(self.weights) / np.mean(self.weights)
        return mean(weights * squares, BLOCKS_DIFFER, sum(self.weights) / total / places.APART**2)


def _law(squares: dict[int, float]) -> tuple[float, float]:
    """The power by which squared errors fall with the count, and its standard deviation.

    What the points say is weighed against what is usual.
    """
    points = [(log(count), log(square)) for count, square in squares.items() if square > 0]
    if len(points) < 2:
        return USUAL, UNUSUAL
    slope, scatter = line(*zip(*points, strict=True))
    spread = points[-1][0] - points[0][0]
    unsure = hypot(scatter, UNUSUAL / 2) / spread
    weight = unsure**-2 / (unsure**-2 + UNUSUAL**-2)
    return weight * -slope + (1 - weight) * USUAL, (unsure**-2 + UNUSUAL**-2) ** -0.5


def _samples(plan: RenderPlan, block: Block, count: int) -> Floats:
    """Radiance (3, P, count) of samples of the pixels of a block."""
    pass_ = Pass(index=1, stride=1, first=0, last=count)
    return radiance(plan, camera_rays(plan, block, pass_), Counter()).reshape(3, -1, count)


def _shown(samples: Floats, count: int) -> Floats:
    """The pixels (3, P) as errors are defined for them: the means of the first samples, clipped to 0..1."""
    return clipped(samples[:, :, :count].mean(axis=2))
