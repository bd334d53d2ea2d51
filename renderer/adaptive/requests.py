"""Requests of a pass: levels of pixels, and what a worker needs to bring those of a tile to them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.guides import Surroundings
from renderer.adaptive.lattice import first_stride
from renderer.adaptive.levels import PREVIEWED, SAMPLED, Levels, node_level
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.time_limits import NO_LIMIT, TimeLimit
from renderer.math.arrays import Masks
from schemas.tiles import Tile

FIRST_AIM, AIM_FACTOR = 2.0**-8, 0.5
"""Under a time limit: the first error aimed at, and the ratio of each next one to the last."""


def first_levels(plan: TargetPlan, tile: Tile) -> Levels:
    """Levels that the first pass requests of the pixels of a tile, (h, w)."""
    target, stride = plan.quality, first_stride(plan.document.camera)
    aim = target.error if target.time_limit is None else max(target.error, FIRST_AIM)
    want = np.zeros((tile.height, tile.width), dtype=np.uint8)
    nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
    want[nodes] = PREVIEWED if plan.pilot else node_level(aim)
    return want


@dataclass(frozen=True, slots=True, eq=False)
class LevelRequest:
    """Present and requested levels of the pixels of a tile, all (h, w) uint8.

    Attributes
    ----------
    have, want
        Levels. A pixel whose requested level is not higher gets no samples.
    coverage, cover
        Numbers of `levels.COVERAGES` at borders: present, and requested.
    """

    have: Levels
    want: Levels
    coverage: Levels
    cover: Levels

    @property
    def previewed(self) -> Masks:
        """Pixels that get a pilot sample."""
        return (self.want == PREVIEWED) & (self.have < PREVIEWED)

    @property
    def covered(self) -> Masks:
        """Pixels whose coverage rises."""
        return self.cover > self.coverage

    @property
    def sampled(self) -> Masks:
        """Pixels that get samples."""
        return (self.want >= SAMPLED) & (self.want > self.have)

    @property
    def rising(self) -> Masks:
        """Pixels with any request."""
        return (self.want > self.have) | self.covered

    @property
    def guided(self) -> Masks:
        """Pixels whose samples are differences from the control variate of borders."""
        return (self.coverage > 0) | (self.cover > 0)

    @classmethod
    def first(cls, want: Levels) -> "LevelRequest":
        """Request levels of pixels that have nothing."""
        return cls(*(np.zeros_like(want), want, np.zeros_like(want), np.zeros_like(want)))

    def needs_pilots(self, plan: TargetPlan) -> bool:
        """Whether any requested pixel may have a control variate from pilot samples."""
        if self.covered.any():
            return True
        tinted = plan.pilot is not None and plan.tinted.any()
        sampled = self.sampled
        return bool(sampled.any() and (tinted or (sampled & self.guided).any()))

    def stacked(self) -> NDArray[np.uint8]:
        """The fields in their order, (4, h, w)."""
        return np.stack((self.have, self.want, self.coverage, self.cover))

    def part(self, tile: Tile) -> "LevelRequest":
        """Levels of a tile, from those of the picture."""
        inside = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        return LevelRequest(
            *(map_[inside].copy() for map_ in (self.have, self.want, self.coverage, self.cover))
        )


@dataclass(frozen=True, slots=True, eq=False)
class TileRequest:
    """Request of a pass for a tile.

    Attributes
    ----------
    tile : Tile
    levels : LevelRequest
    around : Surroundings or None
        Pilot samples, where `levels.needs_pilots`.
    records : bool
        Whether layers are recorded at the centres of pixels: in the first pass only.
    limit : TimeLimit
    """

    tile: Tile
    levels: LevelRequest
    around: Surroundings | None = None
    records: bool = False
    limit: TimeLimit = NO_LIMIT


def tile_request(
    plan: TargetPlan,
    tile: Tile,
    levels: LevelRequest,
    around: Callable[[], Surroundings],
    limit: TimeLimit,
    *,
    first: bool,
) -> TileRequest:
    """Form the request of a pass for a tile.

    Parameters
    ----------
    plan : TargetPlan
    tile : Tile
    levels : LevelRequest
    around : callable
        Returns the pilot samples around the tile; called only if they are needed.
    limit : TimeLimit
    first : bool
        Whether it is the first pass, which records layers.
    """
    return TileRequest(
        tile=tile,
        levels=levels,
        around=around() if levels.needs_pilots(plan) else None,
        records=first and records_centres(plan),
        limit=limit,
    )


def records_centres(plan: TargetPlan) -> bool:
    """Whether the first pass records layers at the centres of pixels."""
    return any(layer.values for layer in plan.layers)
