"""Messages between a pass and its workers: requested levels of a tile's pixels, and their samples."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.guides import Surroundings
from renderer.adaptive.lattice import first_stride
from renderer.adaptive.levels import COUNTS, PREVIEWED, SAMPLED, Levels, node_level
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.time_limits import NO_LIMIT, TimeLimit
from renderer.film import Image
from renderer.layers import Layers
from renderer.math.arrays import Masks
from schemas.tiles import Tile

FIRST_AIM, AIM_FACTOR = 2.0**-8, 0.5
"""Under a time limit: the first error aimed at, and the ratio of each next one to the last."""


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

    @classmethod
    def first(cls, plan: TargetPlan, tile: Tile) -> Self:
        """Request of the first pass: nodes of the coarsest lattice."""
        target, stride = plan.quality, first_stride(plan.document.camera)
        aim = target.error if target.time_limit is None else max(target.error, FIRST_AIM)
        have, want, coverage, cover = np.zeros((4, tile.height, tile.width), dtype=np.uint8)
        nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
        want[nodes] = PREVIEWED if plan.pilot else node_level(aim)
        return cls(have, want, coverage, cover)

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

    def needs_pilots(self, plan: TargetPlan) -> bool:
        """Whether any requested pixel may have a control variate from pilot samples."""
        if self.covered.any():
            return True
        tinted = plan.pilot is not None and plan.tinted.any()
        sampled = self.sampled
        return bool(sampled.any() and (tinted or (sampled & self.guided).any()))

    def stacked(self) -> NDArray[np.uint8]:
        """The fields in their order, (4, h, w)."""
        return np.stack([getattr(self, item.name) for item in fields(self)])

    def part(self, tile: Tile) -> "LevelRequest":
        """Levels of a tile, from those of the picture."""
        return LevelRequest(*self.stacked()[:, tile.y0 : tile.y1, tile.x0 : tile.x1])


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

    @classmethod
    def of(
        cls,
        plan: TargetPlan,
        tile: Tile,
        levels: LevelRequest,
        around: Callable[[], Surroundings],
        limit: TimeLimit,
        *,
        first: bool,
    ) -> Self:
        """Form the request of the `first` pass or of a later one; `around` is called only if needed."""
        nearby = around() if levels.needs_pilots(plan) else None
        return cls(tile, levels, nearby, first and plan.records_centres, limit)


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Results of a pass for a tile, pixels in row-major order.

    Pilot samples of pixels that were at level 0, coverage of border pixels, samples of pixels that continue.

    Attributes
    ----------
    pilots : (3, n) float32
    labels : (n,) int32
        Of the pilot samples' hits: a shape's number, -1 for the background, -2 and below for lights.
    colors : (3, n) float32
        Texture colours at the pilot samples, 1 without a texture.
    shading_errors : (n,) float32
        Expected squared errors of pilot samples that shade fine texture at a few points.
    covers, others : (3, k) float32
    coverage_variance : (k,) float32
        Of border pixels (`coverage.cover`).
    halves : (2, 3, m) float32
        Means of the new samples of either half, or of their differences from a control variate.
    squares : (m,) float32
        Sum over the same of squares about their mean, mean over channels.
    controlled : (m,) bool
        Whether these are differences from a control variate.
    counts, work : dict
    cpu_seconds : float
        As in `TileResult`.
    layers : dict of str to array
        Recorded at the centres of pixels, in the first pass only.
    layer_seconds : float
        CPU seconds of recording them.
    """

    pilots: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    shading_errors: NDArray[np.float32]
    covers: NDArray[np.float32]
    others: NDArray[np.float32]
    coverage_variance: NDArray[np.float32]
    halves: NDArray[np.float32]
    squares: NDArray[np.float32]
    controlled: Masks
    counts: dict[str, int]
    work: dict[str, int]
    cpu_seconds: float
    layers: Layers = field(default_factory=dict)
    layer_seconds: float = 0.0


def preview(tile: Tile, samples: Samples, levels: LevelRequest, before: Image) -> Image:
    """The picture of a tile, (h, w, 3) float32, with the samples of a pass that is not merged yet.

    Nodes of the first pass fill the squares of their lattice; later samples are averaged with earlier ones.
    Differences from a control variate, whose mean is not known here, wait for the pass to be merged.
    `before` is the tile before the pass, and the `levels` are those of its request.
    """
    image = before.copy()
    previewed = levels.previewed
    if previewed.any():
        _fill(image, tile, previewed, samples.pilots)
    if not levels.have.any() and levels.sampled.any():
        _fill(image, tile, levels.sampled, samples.halves.mean(axis=0))
    plain = levels.have[levels.covered] < SAMPLED
    image[levels.covered & (levels.have < SAMPLED)] = samples.covers.T[plain]
    more = levels.sampled
    more[more] = ~samples.controlled
    first, last = COUNTS[levels.have[more]], COUNTS[levels.want[more]]
    share = ((last - first) / last)[:, None]
    image[more] += share * (samples.halves.mean(axis=0).T[~samples.controlled] - image[more])
    return image


def _fill(image: Image, tile: Tile, previewed: Masks, pilots: NDArray[np.float32]) -> None:
    """Paint pilot samples (3, n) over the squares that begin at their pixels."""
    rows, columns = np.nonzero(previewed)
    # New nodes of a lattice are odd multiples of its stride along one axis at least.
    places = np.concatenate((rows + tile.y0, columns + tile.x0))
    stride = int(np.gcd.reduce(places)) or max(tile.width, tile.height)
    nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
    colors = np.zeros((*previewed.shape, 3), dtype=np.float32)
    colors[previewed] = pilots.T
    part = image[-tile.y0 % stride :, -tile.x0 % stride :]
    inside = np.s_[: part.shape[0], : part.shape[1]]
    known = previewed[nodes].repeat(stride, axis=0).repeat(stride, axis=1)[inside]
    np.copyto(
        part, colors[nodes].repeat(stride, axis=0).repeat(stride, axis=1)[inside], where=known[:, :, None]
    )
