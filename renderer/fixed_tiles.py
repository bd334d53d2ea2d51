"""Tiles of fixed quality, rendered at once, or in time slices that pass their state on as arrays."""

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.film import Film
from renderer.integrator import WORK_COUNTERS, OutOfTimeError, camera_rays, centre_points, radiance
from renderer.layers import Layers, Moments, record
from renderer.plan.plan import RenderPlan
from renderer.tiling import BLOCK_RAYS, Block, blocks
from schemas.tiles import Pass, Tile

PORTION_SECONDS = 0.5
"""Seconds that a batch of camera rays may take, so that a time slice is exceeded by no more. Rays through
eight balls of glass take 6 ms each, those beside them a thousandth of that, so no ray predicts the next."""

FEWEST_RAYS = 64
"""Least rays of a batch: with fewer, calls dominate the cost."""

COUNTERS = ("camera", "shadow", "mirror", "transmission", *WORK_COUNTERS)
"""Counters in the order in which an unfinished tile stores them."""


@dataclass(frozen=True, slots=True, eq=False)
class TileResult:
    """One tile of one pass.

    Attributes
    ----------
    pixels : (h, w, 3) float32
        Linear mean over the pass's samples; for the preview one value a stride x stride block.
    counts : dict
        Rays by kind: camera, shadow, mirror, transmission; layers where they were requested.
    work : dict
        `shading_points`: points where rays hit shapes. `texture_lookups`: textures looked up at them; a bump
        map takes four for a point. Both with those of layers.
    cpu_seconds : float
        Of this thread's process.
    layers : dict of str to array
        Values of the plan's layers that the pass recorded, for `layers.LayerBuffers`.
    """

    pixels: NDArray[np.float32]
    counts: dict[str, int]
    work: dict[str, int]
    cpu_seconds: float
    layers: Layers = field(default_factory=dict)


def render_tile(plan: RenderPlan, tile: Tile, pass_: Pass) -> TileResult:
    """Render one tile of one pass.

    A pure function: the result depends on its arguments alone, and no pixel depends on the tile.

    Parameters
    ----------
    plan : RenderPlan
    tile : Tile
        Of `tiling.tiles(plan, pass_)`, or any other within the picture.
    pass_ : Pass
        One of `plan.passes`.
    """
    rendering = TileRendering(plan, tile, pass_)
    rendering.run()
    return rendering.result()


class TileRendering:
    """A tile of a pass in progress, which stops at the end of a time slice and continues from its state.

    However it is cut, the result has the same bytes: the radiance of a ray depends on no other ray.

    Parameters
    ----------
    plan, tile, pass_
        As for `render_tile`.
    kept : mapping of str to array, optional
        The `arrays` of an earlier rendering of the same tile.
    """

    def __init__(
        self,
        plan: RenderPlan,
        tile: Tile,
        pass_: Pass,
        kept: Mapping[str, NDArray[Any]] | None = None,
    ) -> None:
        self._begun = time.process_time()
        self._plan, self._tile, self._pass, self._portion = plan, tile, pass_, BLOCK_RAYS
        self._film = Film(tile, pass_)
        self._layers = plan.layers_in(pass_)
        self._moments = {layer.name: Moments(tile, pass_) for layer in self._layers if layer.sampled}
        self._counts = Counter(dict.fromkeys(COUNTERS, 0))
        # Blocks that are in the film, and the radiance of the first rays of the next one.
        self._finished, self._open = 0, np.empty((3, 0))
        if kept is not None:
            self._restore(kept)

    def run(self, until: float = inf) -> bool:
        """Render what is left, or until a time of `time.monotonic`, but some rays in any case.

        Returns
        -------
        bool
            Whether the tile is finished.
        """
        count, is_late = self._pass.last - self._pass.first, False
        for block in islice(blocks(self._tile, self._pass), self._finished, None):
            while self._open.shape[1] < count * block.columns.size:
                if is_late:
                    return False
                self._extend(block, until)
                is_late = time.monotonic() >= until
            self._close(block)
        return True

    def _extend(self, block: Block, until: float) -> None:
        """Follow the next rays of a block to their end; fewer of them where that takes too long."""
        if until == inf:
            self._follow(block, None, inf)
            return
        begun, portion = time.monotonic(), self._portion
        try:
            self._follow(block, portion, begun + PORTION_SECONDS if portion > FEWEST_RAYS else inf)
        except OutOfTimeError:
            self._portion = max(FEWEST_RAYS, portion // 8)
        else:
            is_fast = time.monotonic() - begun < PORTION_SECONDS / 4
            self._portion = min(2 * portion, BLOCK_RAYS) if is_fast else portion

    def _follow(self, block: Block, count: int | None, until: float) -> None:
        start, counts = self._open.shape[1], Counter[str]()
        rays = camera_rays(self._plan, block, self._pass, slice(start, count and start + count))
        found = radiance(self._plan, rays, counts, until=until)
        self._open = np.hstack((self._open, found)) if start else found
        self._counts.update(counts)

    def _close(self, block: Block) -> None:
        """Add a block to the film once all its rays are cast."""
        for moments in self._moments.values():
            moments.add(block.columns, block.rows, self._open)
        # Last, since it may sum the samples in place.
        self._film.add(block.columns, block.rows, self._open)
        self._finished, self._open = self._finished + 1, np.empty((3, 0))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that is needed to continue later, in another process."""
        return {
            "finished": np.array(self._finished),
            "portion": np.array(self._portion),
            "open": self._open,
            "mean": self._film.mean,
            "counts": np.array([self._counts[kind] for kind in COUNTERS]),
            **{f"moments {name}": moments.record for name, moments in self._moments.items()},
        }

    def _restore(self, kept: Mapping[str, NDArray[Any]]) -> None:
        self._finished, self._portion = int(kept["finished"]), int(kept["portion"])
        self._open = kept["open"]
        self._film.mean[:] = kept["mean"]
        self._counts = Counter(dict(zip(COUNTERS, kept["counts"].tolist(), strict=True)))
        for name, moments in self._moments.items():
            moments.record[:] = kept[f"moments {name}"]

    def result(self) -> TileResult:
        """Return the finished tile, with what its layers record."""
        counts = self._counts.copy()
        records = record(self._layers, self._tile, partial(centre_points, self._plan, counts))
        records |= {name: moments.record for name, moments in self._moments.items()}
        work = {name: counts.pop(name) for name in WORK_COUNTERS}
        return TileResult(self._film.image(), dict(counts), work, time.process_time() - self._begun, records)
