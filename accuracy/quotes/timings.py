"""CPU seconds of fixed qualities, from blocks of the real plan.

The first camera sample is timed in blocks all over the picture, the whole of it where there is time. What the
other samples cost, and those of other ladders, is timed in few of them, as a ratio: where one costs much, so
does the other.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from accuracy.quotes import places
from accuracy.quotes.deadlines import Deadline, within
from accuracy.statistics import factor, mean, ratio
from accuracy.variations import Variant, variants
from renderer.compiling import compile_scene
from renderer.integrator import render_tile
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from renderer.tiling import blocks
from schemas.quality import Quality
from schemas.tiles import Pass, Tile

FIRST = Pass(index=1, stride=1, first=0, last=1)
"""The round of every plan that takes one sample in every pixel."""

DEEPEST = 3
"""Index of the last round of samples that is timed, 4 to 16: those after it take as long for each sample."""

LONGEST = 0.15
"""Seconds that a unit of work shall take at most, as far as it can be cut."""

UNIT, CALLS = 0.03, 0.15
"""Seconds from which on blocks are slow, and share of the time that calls may take in smaller ones."""

SLOW = 4e-6
"""CPU seconds of a ray from which on the round before the deepest is timed: its blocks cover four times the
pixels, and calls are a small part of the time of either."""

UNSTEADY = 0.06
"""Standard deviation of the logarithm of the CPU time of the same work, some seconds later on a machine with
other work: caches and clock rates are shared."""

KNOWN = 1.25
"""A cost is known well enough if it is at most this many times what it is taken for."""

BLOCKS_DIFFER, RATIOS_DIFFER = 0.7, 0.25
"""Relative standard deviations that are usual between blocks of a picture, and between ratios in them."""

FEWEST, EVERY = 2, 5
"""All ladders are timed in the first 2 cells, and then in one of every 5."""

EFFECT_BLOCKS, EFFECT_SIDE = 4, 32
"""Blocks in which an effect is left out, spread over the picture, and their side, pixels: a thousand rays
cost much more than the calls that they take."""

TURNS = 2
"""How often each of these is rendered, with and without; the faster one counts, as nothing can make a block
faster than it is."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What samples of a ladder cost.

    Attributes
    ----------
    first, later : Interval
        CPU seconds of the whole picture for the first sample of every pixel, and for each of the others.
    """

    first: Interval
    later: Interval

    def cpu_seconds(self, count: int) -> Interval:
        """CPU seconds of a picture with so many camera samples."""
        return self.first.plus(self.later.scaled(count - 1)).times(factor(UNSTEADY))


@dataclass(slots=True)
class Stopwatch:
    """Times the samples of several ladders in blocks of one picture.

    Attributes
    ----------
    plans : list of RenderPlan
        One a ladder, the requested one first.
    firsts : list of (float, int)
        CPU seconds of the first sample in cells, and their pixels.
    pairs : list of list of (float, float, float)
        For each plan, from cells where all were timed, CPU seconds a pixel: the first sample of the first
        plan, its own first sample, and each of its later ones.
    """

    plans: list[RenderPlan]
    firsts: list[tuple[float, int]] = field(default_factory=list)
    pairs: list[list[tuple[float, float, float]]] = field(init=False)

    def __post_init__(self) -> None:
        """Begin with nothing timed."""
        self.pairs = [[] for _ in self.plans]

    def run(self, goal: Deadline, deadline: Deadline) -> None:
        """Time blocks until the goal; longer where costs are not known well enough by then."""
        plan = self.plans[0]
        for side in within(deadline, [self._side]):
            cells = places.cells(plan.width, plan.height, side, plan.seed)
            for _ in within(deadline, self._units(cells)):
                if goal.left < 0 and self._known():
                    return

    def _known(self) -> bool:
        timings = [self.timing(number) for number in range(len(self.plans))]
        return all(timing and timing.later.high <= KNOWN * timing.later.estimate for timing in timings)

    def _side(self) -> int:
        """Side of the cells: that of the plan's blocks, or less where these are slow.

        Many small cells show more than few large ones, but small blocks cost more a ray. A block is taken
        to cost so much for its calls and so much for each ray, which two small ones show.
        """
        self._probe(places.SMALL)  # fills caches
        small, medium = self._probe(places.SMALL), self._probe(2 * places.SMALL)
        if medium > LONGEST:
            return places.SMALL
        # The larger one has four times the rays: three times those of the smaller one more.
        calls = max(small - (medium - small) / 3, 0.0)
        large = calls + (medium - calls) * 4
        slow = large > LONGEST or (large > UNIT and calls < CALLS * medium)
        return 2 * places.SMALL if slow else places.SIDE

    def _probe(self, side: int) -> float:
        """CPU seconds of a block in the middle of the picture."""
        plan = self.plans[0]
        x, y = max(plan.width - side, 0) // 2, max(plan.height - side, 0) // 2
        tile = Tile(0, x, y, min(x + side, plan.width), min(y + side, plan.height))
        return render_tile(plan, tile, FIRST).cpu_seconds

    def _units(self, cells: list[Tile]) -> Iterator[partial[None]]:
        for number, cell in enumerate(cells):
            yield partial(self._time, cell)
            if number < FEWEST or number % EVERY == 0:
                yield from (partial(self._compare, each, cell) for each in range(len(self.plans)))

    def _time(self, cell: Tile) -> None:
        seconds = render_tile(self.plans[0], cell, FIRST).cpu_seconds
        self.firsts.append((seconds, cell.width * cell.height))

    def _compare(self, number: int, cell: Tile) -> None:
        """Time a plan in the cell that was timed last."""
        seconds, pixels = self.firsts[-1]
        plan = self.plans[number]
        own = seconds if number == 0 else render_tile(plan, cell, FIRST).cpu_seconds
        later = _later(plan, cell, DEEPEST if seconds < SLOW * pixels else DEEPEST - 1)
        self.pairs[number].append((seconds / pixels, own / pixels, later or own / pixels))

    def timing(self, number: int) -> Timing | None:
        """What samples of a ladder cost; None if not a single block was timed.

        Later samples are taken to cost what the first one does until one was timed.
        """
        if number >= len(self.plans) or not self.firsts or not (self.pairs[number] or number == 0):
            return None
        total = self.plans[0].width * self.plans[0].height
        seconds, pixels = np.array(self.firsts).T
        # Cells at the edges are smaller: what counts is the mean over pixels.
        base = mean(seconds / pixels.mean(), BLOCKS_DIFFER, pixels.sum() / total).scaled(total)
        if not self.pairs[number]:
            return Timing(base, base.times(factor(RATIOS_DIFFER)))
        bases, firsts, laters = zip(*self.pairs[number], strict=True)
        first = base if number == 0 else base.times(ratio(firsts, bases, RATIOS_DIFFER))
        return Timing(first, base.times(ratio(laters, bases, RATIOS_DIFFER)))


def _later(plan: RenderPlan, cell: Tile, deepest: int) -> float | None:
    """CPU seconds of a sample of a later round, from a block in a cell; None if there is but one round."""
    later = plan.passes[min(deepest, len(plan.passes) - 1)]
    if later.first == 0:
        return None
    inside = list(blocks(cell, later))
    block = inside[int(np.random.default_rng((plan.seed, cell.index)).integers(len(inside)))]
    count = block.columns.size * (later.last - later.first)
    return render_tile(plan, Tile(0, *block.bounds), later).cpu_seconds / count


def effect_shares(
    scene: LoadedScene, quality: Quality, plan: RenderPlan, deadline: Deadline, first: float
) -> list[tuple[Variant, float]]:
    """Leave out one effect after another, as long as there is time.

    Parameters
    ----------
    scene : LoadedScene
    quality : Quality
    plan : RenderPlan
        That of the scene at this quality.
    deadline : Deadline
    first : float
        Seconds that the first effect is taken to last, at least.

    Returns
    -------
    list of (Variant, float)
        The scene without the effect, and the share of the CPU seconds that goes when it goes.
    """
    tiles = places.cells(plan.width, plan.height, EFFECT_SIDE, plan.seed)[:EFFECT_BLOCKS]

    def share(variant: Variant) -> tuple[Variant, float]:
        other = compile_scene(replace(scene, document=variant.document), quality)
        with_it, without = (sum(_fastest(each, tile) for tile in tiles) for each in (plan, other))
        return variant, 1 - without / with_it if with_it else 0.0

    # What more samples cost is known from the ladder.
    kept = (variant for variant in variants(scene.document) if variant.effect != "antialiasing")
    return list(within(deadline, (partial(share, variant) for variant in kept), first))


def _fastest(plan: RenderPlan, tile: Tile) -> float:
    return min(render_tile(plan, tile, FIRST).cpu_seconds for _ in range(TURNS))
