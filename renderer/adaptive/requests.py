"""What a pass asks for: levels of pixels, and all that a worker needs to bring those of a tile to them."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.guides import Surroundings
from renderer.adaptive.lattice import stride_for
from renderer.adaptive.levels import PREVIEWED, SAMPLED, Levels, node_level
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.time_limits import TimeLimit
from renderer.math.arrays import Masks
from schemas.quality import TargetQuality
from schemas.tiles import Tile

FIRST_AIM, NEXT_AIM = 2.0**-8, 0.5
"""With a time limit: the first error aimed at, and each next one as a share of the last."""

COARSER = 2
"""Stride of the first lattice through a lens, over that of pilot samples: a node costs eight rays or more."""


def first_stride(plan: TargetPlan) -> int:
    """Pixels between the nodes of a picture's first lattice, also of a part of the picture."""
    return stride_for(*plan.document.camera.picture_size) * (1 if plan.pilot else COARSER)


def first_levels(plan: TargetPlan, tile: Tile) -> Levels:
    """Levels requested by the first pass for the pixels of a tile, (h, w)."""
    target = plan.quality
    assert isinstance(target, TargetQuality)
    aim = target.error if target.time_limit is None else max(target.error, FIRST_AIM)
    stride = first_stride(plan)
    want = np.zeros((tile.height, tile.width), dtype=np.uint8)
    nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
    want[nodes] = PREVIEWED if plan.pilot else node_level(aim)
    return want


@dataclass(frozen=True, slots=True, eq=False)
class LevelRequest:
    """What the pixels of a tile have and what a pass wants of them, all (h, w) uint8.

    Attributes
    ----------
    have, want
        Levels. A pixel whose wanted level is not higher gets no samples.
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
        """Pixels of which anything is requested."""
        return (self.want > self.have) | self.covered

    @property
    def guided(self) -> Masks:
        """Pixels whose samples are differences from the guide."""
        return (self.coverage > 0) | (self.cover > 0)

    @classmethod
    def first(cls, want: Levels) -> "LevelRequest":
        """The request for pixels that have nothing."""
        return cls(*(np.zeros_like(want), want, np.zeros_like(want), np.zeros_like(want)))

    def needs_pilots(self, plan: TargetPlan) -> bool:
        """Whether anything is requested of pixels that may have a control variate from pilot samples."""
        if self.covered.any():
            return True
        adaptive = plan
        tinted = adaptive.pilot is not None and adaptive.tinted.any()
        sampled = self.sampled
        return bool(sampled.any() and (tinted or (sampled & self.guided).any()))

    def stacked(self) -> NDArray[np.uint8]:
        """All of it, (4, h, w), in the order of the fields."""
        return np.stack((self.have, self.want, self.coverage, self.cover))

    def part(self, tile: Tile) -> "LevelRequest":
        """Those of a tile, where these are of the picture."""
        inside = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        return LevelRequest(
            *(map_[inside].copy() for map_ in (self.have, self.want, self.coverage, self.cover))
        )


@dataclass(frozen=True, slots=True, eq=False)
class TileRequest:
    """What a pass asks of a tile.

    Attributes
    ----------
    tile : Tile
    levels : LevelRequest
    around : Surroundings or None
        Pilot samples, where `levels.needs_pilots`.
    records : bool
        Whether the layers that the centres of pixels show are recorded, too: once, in the first pass.
    limit : TimeLimit or None
        The first pass has none but for a time slice.
    """

    tile: Tile
    levels: LevelRequest
    around: Surroundings | None = None
    records: bool = False
    limit: TimeLimit | None = None

    @property
    def until(self) -> float:
        """When the tile has to be finished, by `time.monotonic`; inf where there is no limit."""
        return self.limit.until if self.limit else inf


def tile_request(
    plan: TargetPlan,
    tile: Tile,
    levels: LevelRequest,
    around: Callable[[], Surroundings],
    limit: TimeLimit | None,
    *,
    first: bool,
) -> TileRequest:
    """What a pass asks of a tile.

    Parameters
    ----------
    plan : TargetPlan
    tile : Tile
    levels : LevelRequest
    around : callable
        Gives the pilot samples around the tile; called only if they are needed.
    limit : TimeLimit or None
    first : bool
        Whether it is the first pass, which records layers and is never cut short: without it there is no
        picture.
    """
    return TileRequest(
        tile=tile,
        levels=levels,
        around=around() if levels.needs_pilots(plan) else None,
        records=first and records_centres(plan),
        limit=None if first else limit,
    )


def records_centres(plan: TargetPlan) -> bool:
    """Whether the first pass records what the centres of pixels show."""
    return any(layer.values for layer in plan.layers)
