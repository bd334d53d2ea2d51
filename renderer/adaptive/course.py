"""A picture of target quality in the making: one pass after another, in whichever process renders them."""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from renderer.adaptive.coverage import Surroundings, surroundings
from renderer.adaptive.decisions import advance
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.levels import COVERED, Levels
from renderer.adaptive.samples import Samples, render_samples
from renderer.errors import told
from renderer.execute import WORK
from renderer.plan import RenderPlan
from renderer.results import TileEvent
from renderer.tiling import tiles
from schemas.tiles import Pass, Tile

RAYS = 32768
"""Camera rays of a tile, unless a size is asked for: in most passes few pixels have anything to do, so tiles
are as large as that needs. Half of that costs a twentieth more."""

SIDES = (64, 4096)
"""Least and greatest side of a tile, pixels, that is chosen so."""


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """What a pass asks of a tile: `have` and `want` are those of its pixels, (h, w) uint8.

    `around` is there where pixels at borders are wanted.
    """

    tile: Tile
    have: Levels
    want: Levels
    around: Surroundings | None


Each = Callable[[list[Demand]], Iterator[tuple[Demand, Samples]]]
"""Renders what a pass asks for, in any order."""


@dataclass(slots=True)
class Course:
    """A picture in the making: its passes, one after another, and what they took.

    Attributes
    ----------
    plan : RenderPlan
    tile_size : int or None
        Side of tiles, pixels; None for one that suits each pass.
    on_tile : callable or None
        Called with each tile.
    deadline, begun : float
        By the clock of `time.monotonic`, seconds.
    estimate : Estimate
    counts : Counter
        Rays by kind, and `execute.WORK`.
    cpu_seconds : float
    done : int
        Tiles.
    passes : list of dict
        What had been spent when each pass ended, and the error by then.
    """

    plan: RenderPlan
    tile_size: int | None
    on_tile: Callable[[TileEvent], None] | None
    deadline: float
    begun: float
    estimate: Estimate
    counts: Counter[str] = field(default_factory=Counter)
    cpu_seconds: float = 0.0
    done: int = 0
    passes: list[dict[str, Any]] = field(default_factory=list)

    def step(self, each: Each) -> bool:
        """Render a pass; False if the picture is done or its time is over.

        The first, a coarse picture, is never cut short.
        """
        for demand, samples in each(self.demands()):
            self.take(demand.tile, samples)
            if self.passes and time.monotonic() > self.deadline:
                self.estimate.settle()
                self.note()
                return False
        begun = time.process_time()
        more = advance(self.estimate)
        self.cpu_seconds += time.process_time() - begun
        self.note()
        return more

    def demands(self) -> list[Demand]:
        """The tiles of a pass in which something is wanted."""
        have, want = self.estimate.have, self.estimate.want
        cuts = tiles(self.plan, self.number(), self.tile_size or side(self.estimate))
        parts = [(tile, np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]) for tile in cuts]
        return [
            Demand(tile, have[part].copy(), want[part].copy(), self.around(tile, want[part]))
            for tile, part in parts
            if (want[part] > have[part]).any()
        ]

    def around(self, tile: Tile, want: Levels) -> Surroundings | None:
        """First looks around a tile, if it needs them."""
        estimate = self.estimate
        wanted = (want == COVERED).any()
        return surroundings(tile, estimate.values, estimate.labels) if wanted else None

    def number(self) -> Pass:
        """The pass that runs."""
        return Pass(index=len(self.passes), stride=1, first=0, last=0)

    def take(self, tile: Tile, samples: Samples) -> None:
        """Keep what was found in a tile, and show it."""
        self.estimate.take(tile, samples)
        self.counts.update(samples.counts)
        self.counts.update(samples.work)
        self.cpu_seconds += samples.cpu_seconds
        self.done += 1
        if self.on_tile:
            pixels = self.estimate.part(tile)
            self.on_tile(TileEvent(tile, self.number(), pixels, self.done, self.done + 1))

    def note(self) -> None:
        """Keep what the picture has taken when a pass ends, and its error, if that is known by then."""
        error = self.estimate.error
        rays = {name: count for name, count in self.counts.items() if name not in WORK}
        self.passes.append(
            {
                "seconds": time.monotonic() - self.begun,
                "cpu_seconds": self.cpu_seconds,
                "rays": rays,
                "error": None if error is None else error.document(),
            }
        )


def side(estimate: Estimate) -> int:
    """Side of a tile that has about `RAYS` rays, if those of the next pass are spread evenly; pixels."""
    rays = estimate.rays_wanted()
    pixels = np.sqrt(estimate.plan.width * estimate.plan.height * RAYS / max(rays, 1))
    return int(np.clip(pixels, *SIDES))


def answer(plan: RenderPlan, demand: Demand) -> Samples:
    """Render what is asked of a tile; what goes wrong tells which tile it was."""
    with told(plan.seed, demand.tile, f"levels up to {demand.want.max()}"):
        return render_samples(plan, demand.tile, demand.have, demand.want, demand.around)
