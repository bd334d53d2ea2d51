"""Errors of fixed qualities, from pixels that are sampled twice.

Two independent sets of samples of a pixel, a and b, are unbiased. So the mean over pixels of (u - a) (u - b)
is the squared error of any other samples u, whatever the errors of a and b; and half the mean of (a - b)^2 is
the squared error of a.
"""

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import partial
from math import exp, log

import numpy as np

from accuracy.quotes import pilot_pixels
from accuracy.quotes.deadlines import Deadline, within
from accuracy.statistics import clipped, factor, mean
from renderer.integrator import camera_rays, radiance
from renderer.math.arrays import Floats
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan
from renderer.tiling import Block
from schemas.tiles import Pass, Tile

MEASURED_SAMPLES = (1, 4, 16)
"""Sample counts whose error a pilot measures: the first samples of each set, and all."""

ERROR_EXPONENT, EXPONENT_DEVIATION = 1.25, 0.5
"""Squared errors fall like this power of the number of samples; with its standard deviation over patterns and
pictures. It is 1 for independent samples, 3/2 for low-discrepancy ones at edges."""

BLOCKS_DIFFER = 1.5
"""Usual relative standard deviation of the squared errors of blocks: some contain no edge."""

FEWEST_PIXELS = 256
"""Errors are not estimated from fewer pixels, unless these cover the whole picture: edges are rare. In the
gallery, intervals from 256 pixels contained the error in nine of ten trials, from 128 in eight, and from 64
in seven, where estimates were as low as a tenth of it."""

TOO_FEW = "Only {pixels} pixels were sampled, too few to estimate an error: edges may lie between them."
AS_ZERO = "In the {pixels} pixels that were sampled the error cannot be distinguished from zero."


class UnknownAccuracyError(Exception):
    """No error can be estimated from the sampled pixels; the message says why."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Measured root mean square errors at counts of a ladder."""

    known: dict[int, Interval]

    def error(self, count: float) -> Interval:
        """The error at any count, extrapolated from the nearest measured one by the usual power law."""
        nearest = min(self.known, key=lambda known: abs(log(known / count)))
        apart = log(count / nearest)
        moved = factor(EXPONENT_DEVIATION / 2 * abs(apart)).scaled(exp(-ERROR_EXPONENT / 2 * apart))
        return self.known[nearest].times(moved)


@dataclass(slots=True)
class Sampled:
    """Errors measured in blocks spread over the picture.

    Attributes
    ----------
    sets : pair of RenderPlan
        Plans of the two sets: the same ladder with two seeds.
    other : RenderPlan or None
        Plan of another ladder.
    squares : dict of (bool, int) to list of float
        Mean squared errors in each block, for each count; True is of the other ladder.
    weights : list of int
        Pixels that each block stands for.
    pixels : int
        Number of sampled pixels.
    """

    sets: tuple[RenderPlan, RenderPlan]
    other: RenderPlan | None = None
    squares: defaultdict[tuple[bool, int], list[float]] = field(default_factory=lambda: defaultdict(list))
    weights: list[int] = field(default_factory=list)
    pixels: int = 0

    def run(self, deadline: Deadline) -> None:
        """Sample pixels until the deadline, or in all blocks."""
        plan = self.sets[0]
        cells = pilot_pixels.cells(plan.width, plan.height, pilot_pixels.SMALL_BLOCK_SIDE, plan.seed)
        for _ in within(deadline, (partial(self._block, cell) for cell in cells)):
            pass

    def _block(self, cell: Tile) -> None:
        most = MEASURED_SAMPLES[-1]
        block = pilot_pixels.scattered(cell, self.sets[0].seed)
        one, another = (_samples(plan, block, most) for plan in self.sets)
        a, b = _shown(one, most), _shown(another, most)
        own = float(np.mean((a - b) ** 2)) / 2
        for count in MEASURED_SAMPLES:
            few = float(np.mean((_shown(one, count) - b) ** 2)) - own
            self.squares[False, count].append(own if count == most else few)
        if self.other is not None:
            count = self.other.antialiasing.samples
            u = _shown(_samples(self.other, block, count), count)
            self.squares[True, count].append(float(np.mean((u - a) * (u - b))))
        self.pixels += block.columns.size
        self.weights.append(cell.width * cell.height)

    def accuracy(self, *, other: bool) -> Accuracy:
        """Errors of the other ladder, or of that of the two sets.

        Raises
        ------
        UnknownAccuracyError
            If too few pixels were sampled, or they show no error that differs from zero.
        """
        whole = self._share >= 1
        if self.pixels < FEWEST_PIXELS and not whole:
            raise UnknownAccuracyError(TOO_FEW.format(pixels=self.pixels))
        squares = {count: found for (of_other, count), found in self.squares.items() if of_other == other}
        means = {count: self._mean(found) for count, found in squares.items()}
        # If nothing differs anywhere, as in a picture of the background alone, there is no error.
        none = whole and not any(map(any, squares.values()))
        known = {count: square.root() for count, square in means.items() if square.estimate > 0 or none}
        if not known:
            raise UnknownAccuracyError(AS_ZERO.format(pixels=self.pixels))
        return Accuracy(known)

    @property
    def _share(self) -> float:
        """Share of the picture that the blocks stand for."""
        return sum(self.weights) / (self.sets[0].width * self.sets[0].height)

    def _mean(self, squares: list[float]) -> Interval:
        weights = np.array(self.weights) / np.mean(self.weights)
        return mean(weights * squares, BLOCKS_DIFFER, self._share / pilot_pixels.PIXEL_SPACING**2)


def _samples(plan: RenderPlan, block: Block, count: int) -> Floats:
    """Radiance (3, P, count) of samples of the pixels of a block."""
    pass_ = Pass(index=1, stride=1, first=0, last=count)
    return radiance(plan, camera_rays(plan, block, pass_), Counter()).reshape(3, -1, count)


def _shown(samples: Floats, count: int) -> Floats:
    """The pixels (3, P) as errors are defined for them: the means of the first samples, clipped to 0..1."""
    return clipped(samples[:, :, :count].mean(axis=2))
