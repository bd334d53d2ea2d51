"""What each effect costs: the same blocks with it and without it, as `ablation` leaves it out."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

from accuracy.quotes import places
from accuracy.quotes.ablation import Variant, variants
from accuracy.quotes.deadlines import Deadline, within
from accuracy.quotes.settings import compiled
from accuracy.quotes.timings import FIRST
from renderer.integrator import render_tile
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from schemas.quality import FixedQuality
from schemas.tiles import Tile

BLOCKS = 4
"""Blocks in which an effect is left out, spread over the picture."""

SIDE = 32
"""Their side, pixels: a thousand rays cost much more than the calls that they take."""

TURNS = 2
"""How often each block is rendered, with and without; the faster one counts, as nothing can make a block
faster than it is."""


@dataclass(frozen=True, slots=True)
class Without:
    """An effect, and the share of the CPU seconds that goes when it goes."""

    variant: Variant
    share: float


@dataclass(slots=True)
class Ablation:
    """Leaves out one effect after another.

    Attributes
    ----------
    scene : LoadedScene
    quality : FixedQuality
    plan : RenderPlan
        That of the quality with all effects.
    found : list of Without
    """

    scene: LoadedScene
    quality: FixedQuality
    plan: RenderPlan
    found: list[Without] = field(default_factory=list)

    def run(self, deadline: Deadline, first: float) -> None:
        """Measure effects until the deadline; the first is taken to last at least `first` seconds."""
        for effect in within(deadline, self._units(), first):
            self.found.append(effect)

    def _units(self) -> Iterator[partial[Without]]:
        for variant in variants(self.scene.document):
            # The price of more samples is known from the ladder.
            if variant.effect != "antialiasing":
                yield partial(self._measure, variant)

    def _measure(self, variant: Variant) -> Without:
        plan = compiled(LoadedScene(variant.document, self.scene.assets), self.quality)
        size = self.plan.width, self.plan.height
        tiles = places.cells(*size, SIDE, self.plan.seed)[:BLOCKS]
        with_it, without = (sum(_fastest(each, tile) for tile in tiles) for each in (self.plan, plan))
        return Without(variant, 1 - without / with_it if with_it else 0.0)


def _fastest(plan: RenderPlan, tile: Tile) -> float:
    return min(render_tile(plan, tile, FIRST).cpu_seconds for _ in range(TURNS))
