"""CPU seconds of fixed qualities, from the cost of each pass in blocks spread over the picture."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from math import hypot, sqrt

import numpy as np

from accuracy.quotes import pilot_pixels
from accuracy.quotes.deadlines import Deadline, within
from accuracy.statistics import USUAL_DEGREES, factor
from accuracy.variations import Variant, variants
from renderer.compiling import compile_scene
from renderer.fixed_tiles import render_tile
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from renderer.tiling import block_side, passes
from schemas.tiles import Pass, Tile

FIRST_PASS = Pass(index=1, stride=1, first=0, last=1)
"""The pass with one sample per pixel, which every plan has."""

MAX_BLOCK_SECONDS = 0.03
"""If a small block takes longer, larger ones are not used, so that more fit: on `glass` at 112 x 112 pixels
and 16 samples the quote is 0.9 of the cost, but 0.5 with blocks of the renderer's size."""

TIMING_DEVIATION = 0.21
"""Standard deviation of the logarithm of the ratio of CPU times of a picture and its repetition seconds
later: 0.14 in 233 pictures, 0.22 in 42 with two to four other programs on two processors, 0.18 in 66 with
ten. A thread is up to 1.5 times slower while its core runs another."""

BLOCKS_DIFFER = 0.7
"""Usual relative standard deviation of the price of rays between blocks of a picture."""

EFFECT_BLOCKS, EFFECT_RENDERS = 4, 2
"""Small blocks in which an effect is left out, and repetitions; the fastest counts, since interference only
adds time."""


@dataclass(slots=True)
class Stopwatch:
    """Measures the time of blocks of a plan, until the deadline.

    Attributes
    ----------
    plan : RenderPlan
    found : dict of int to list of (float, int)
        By the index of the pass, CPU seconds of a block, and its camera rays.
    """

    plan: RenderPlan
    found: dict[int, list[tuple[float, int]]] = field(default_factory=dict)

    @property
    def blocks(self) -> int:
        """Number of timed blocks."""
        return sum(map(len, self.found.values()))

    def run(self, deadline: Deadline) -> None:
        """Measure blocks of all passes in turns, until the deadline or the whole picture is done."""
        for _ in within(deadline, self._units()):
            pass

    def _units(self) -> Iterator[partial[None]]:
        plan = self.plan
        most = pilot_pixels.SMALL_BLOCK_SIDE if self._probe() > MAX_BLOCK_SECONDS else block_side(FIRST_PASS)
        timed = [(pass_, min(block_side(pass_), most)) for pass_ in plan.passes[1:]]
        for turn in range(max((most // side) ** 2 for _, side in timed)):
            for cell in pilot_pixels.cells(plan.width, plan.height, most, plan.seed):
                for pass_, side in timed:
                    parts = pilot_pixels.parts(cell, side, plan.seed)
                    if turn < len(parts):
                        yield partial(self._time, parts[turn], pass_)

    def _probe(self) -> float:
        """CPU seconds of a block in the middle of the picture, with warm caches."""
        plan, side = self.plan, pilot_pixels.SMALL_BLOCK_SIDE
        x, y = max(plan.width - side, 0) // 2, max(plan.height - side, 0) // 2
        tile = Tile(0, x, y, min(x + side, plan.width), min(y + side, plan.height))
        return min(render_tile(plan, tile, FIRST_PASS).cpu_seconds for _ in range(2))

    def _time(self, tile: Tile, pass_: Pass) -> None:
        rays = tile.width * tile.height * (pass_.last - pass_.first)
        self.found.setdefault(pass_.index, []).append((render_tile(self.plan, tile, pass_).cpu_seconds, rays))

    def cpu_seconds(self, count: int) -> Interval:
        """CPU seconds of a picture with these camera samples, if at least one block was timed."""
        pixels, total, variance = self.plan.width * self.plan.height, 0.0, 0.0
        scatter = self._scatter()
        for pass_ in passes(self.plan.width, self.plan.height, count)[1:]:
            # Deeper passes are assumed to cost as much as the deepest one measured.
            seconds, rays = np.array(self.found[min(pass_.index, max(self.found))], dtype=float).T
            cost = pixels * (pass_.last - pass_.first) * seconds.sum() / rays.sum()
            covered = min(rays.sum() / (pixels * self._samples(pass_.index)), 1.0)
            total += cost
            variance += cost**2 * (1 - covered) / seconds.size
        unsure = sqrt(scatter * variance) / total if total else 0.0
        return factor(hypot(unsure, TIMING_DEVIATION)).scaled(total)

    def _samples(self, index: int) -> int:
        pass_ = self.plan.passes[min(index, max(self.found))]
        return pass_.last - pass_.first

    def _scatter(self) -> float:
        """Squared relative standard deviation between blocks, of all passes together."""
        squares, freedom = USUAL_DEGREES * BLOCKS_DIFFER**2, float(USUAL_DEGREES)
        for found in self.found.values():
            seconds, rays = np.array(found, dtype=float).T
            prices = seconds / rays
            squares += float(np.sum((prices / prices.mean() - 1) ** 2))
            freedom += prices.size - 1
        return squares / freedom


def effect_shares(
    scene: LoadedScene, plan: RenderPlan, deadline: Deadline, first: float
) -> list[tuple[Variant, float]]:
    """Leave out one effect after another, until the deadline.

    Yields the scenes without an effect, and the share of the plan's CPU seconds that this saves. The first is
    expected to take at least `first` seconds.
    """
    tiles = [
        *islice(
            pilot_pixels.cells(plan.width, plan.height, pilot_pixels.SMALL_BLOCK_SIDE, plan.seed),
            EFFECT_BLOCKS,
        )
    ]

    def share(variant: Variant) -> tuple[Variant, float]:
        other = compile_scene(replace(scene, document=variant.document), plan.quality)
        with_it, without = (sum(_fastest(each, tile) for tile in tiles) for each in (plan, other))
        return variant, 1 - without / with_it if with_it else 0.0

    # The passes give the cost of more samples.
    kept = (variant for variant in variants(scene.document) if variant.effect != "antialiasing")
    return list(within(deadline, (partial(share, variant) for variant in kept), first))


def _fastest(plan: RenderPlan, tile: Tile) -> float:
    return min(render_tile(plan, tile, FIRST_PASS).cpu_seconds for _ in range(EFFECT_RENDERS))
