"""Rendering what an adaptive pass asks of a tile."""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.camera_rays import camera_rays
from renderer.adaptive.coverage import cover
from renderer.adaptive.guides import Surroundings, guide
from renderer.adaptive.halves import HALVES, places
from renderer.adaptive.labels import labels_of, of_labels
from renderer.adaptive.levels import COUNTS, COVERAGES, LOOKED, SAMPLED, Levels
from renderer.adaptive.time_limits import TimeLimit, portions
from renderer.film import BRIGHTEST
from renderer.integrator import WORK, Surfaces, radiance
from renderer.layers import Layers
from renderer.math import morton
from renderer.math.arrays import Floats, Integers, Masks, add, taken
from renderer.math.numerics import halving_sum
from renderer.plan.plan import RenderPlan
from schemas.tiles import Tile


@dataclass(frozen=True, slots=True, eq=False)
class Demanded:
    """What the pixels of a tile have and what a pass wants of them, all (h, w) uint8.

    Attributes
    ----------
    have, want
        Levels. A pixel whose wanted level is not higher gets no samples.
    coverage, cover
        Numbers of `levels.COVERAGES` at borders: had, and wanted.
    """

    have: Levels
    want: Levels
    coverage: Levels
    cover: Levels

    @property
    def looked(self) -> Masks:
        """Pixels that get a pilot sample."""
        return (self.want == LOOKED) & (self.have < LOOKED)

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
        """Pixels of which anything is wanted."""
        return (self.want > self.have) | self.covered

    @property
    def guided(self) -> Masks:
        """Pixels whose samples are differences from the guide."""
        return (self.coverage > 0) | (self.cover > 0)

    @classmethod
    def first(cls, want: Levels) -> "Demanded":
        """What is wanted of pixels that have nothing."""
        return cls(*(np.zeros_like(want), want, np.zeros_like(want), np.zeros_like(want)))

    def needs_looks(self, plan: RenderPlan) -> bool:
        """Whether anything is asked of pixels that may have a control variate, made from pilot samples."""
        if self.covered.any():
            return True
        tinted = plan.look is not None and plan.tinted.any()
        sampled = self.sampled
        return bool(sampled.any() and (tinted or (sampled & self.guided).any()))

    def stacked(self) -> NDArray[np.uint8]:
        """All of it, (4, h, w), in the order of the fields."""
        return np.stack((self.have, self.want, self.coverage, self.cover))

    def part(self, tile: Tile) -> "Demanded":
        """Those of a tile, where these are of the picture."""
        inside = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        return Demanded(*(map_[inside].copy() for map_ in (self.have, self.want, self.coverage, self.cover)))


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """What a pass has found in a tile.

    Pixels are in the order of rows: first looks of those that were at level 0, looks at borders, samples of
    those that go on.

    Attributes
    ----------
    looks : (3, n) float32
    labels : (n,) int32
        What the first looks met: a shape's number, -1 for the background, -2 and below for lights.
    colors : (3, n) float32
        What textures gave at the first looks, 1 where there was none.
    residues : (n,) float32
        Squared errors to expect of first looks that met what varies within the pixel at a few places.
    covers, known : (3, k) float32
    spread, doubts : (k,) float32
        Of pixels at borders (`coverage.Cover`).
    halves : (2, 3, m) float32
        Means of the new samples of either half, or of their differences from a control variate.
    squares : (m,) float32
        Sum over the same of squares about their mean, mean over channels.
    controlled : (m,) bool
        Whether these are differences from a control variate.
    counts, work : dict
    cpu_seconds : float
        As in `execute.TileResult`.
    layers : dict of str to array
        What the centres of pixels show, in the pass that records it.
    layer_seconds : float
        CPU seconds that this took besides.
    """

    looks: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    residues: NDArray[np.float32]
    covers: NDArray[np.float32]
    known: NDArray[np.float32]
    spread: NDArray[np.float32]
    doubts: NDArray[np.float32]
    halves: NDArray[np.float32]
    squares: NDArray[np.float32]
    controlled: Masks
    counts: dict[str, int]
    work: dict[str, int]
    cpu_seconds: float
    layers: Layers = field(default_factory=dict)
    layer_seconds: float = 0.0


def render_samples(
    plan: RenderPlan,
    tile: Tile,
    levels: Demanded,
    around: Surroundings | None = None,
    limit: TimeLimit | None = None,
) -> Samples:
    """Bring the pixels of a tile from the levels that they have to those that are wanted.

    A pure function of its arguments, and what it finds about a pixel does not depend on the tile.

    Parameters
    ----------
    plan : RenderPlan
        Of target quality.
    tile : Tile
    levels : Demanded
    around : Surroundings, optional
        Pilot samples; needed where `levels.guided`.
    limit : TimeLimit, optional

    Raises
    ------
    OutOfTimeError
        If the limit is reached: what was found by then is lost.
    """
    begun = time.process_time()
    counts: Counter[str] = Counter(camera=0, shadow=0, mirror=0, transmission=0, **dict.fromkeys(WORK, 0))
    looks, labels, seen = _first_looks(plan, tile, levels.looked, counts, limit)
    covers = _covers(plan, tile, levels, around, counts, limit)
    samples = _samples(plan, tile, levels, around, counts, limit)
    work = {name: counts.pop(name) for name in WORK}
    seconds = time.process_time() - begun
    colors, residues = seen.colors.astype(np.float32), seen.doubts.astype(np.float32)
    return Samples(looks, labels, colors, residues, *covers, *samples, dict(counts), work, seconds)


def _first_looks(
    plan: RenderPlan, tile: Tile, wanted: Masks, counts: Counter[str], limit: TimeLimit | None
) -> tuple[NDArray[np.float32], NDArray[np.int32], Surfaces]:
    look = plan.look or plan
    rows, columns = np.nonzero(wanted)
    values = np.empty((3, rows.size), dtype=np.float32)
    labels = np.empty(rows.size, dtype=np.int32)
    found = Surfaces.none(rows.size)
    middle = np.full(rows.size, 0.5)
    for chosen in _batches(columns, rows, 1, limit):
        x, y = columns[chosen] + tile.x0, rows[chosen] + tile.y0
        rays = camera_rays(look, x, y, np.full(x.size, HALVES), (middle[chosen], middle[chosen]))
        seen = Surfaces.none(x.size)
        values[:, chosen] = np.minimum(radiance(look, rays, counts, seen), BRIGHTEST)
        labels[chosen] = labels_of(rays.shapes)
        np.copyto(seen.colors, 1.0, where=~of_labels(plan.textured, labels[chosen]))
        found.colors[:, chosen], found.doubts[chosen] = seen.colors, seen.doubts
    return values, labels, found


def _covers(
    plan: RenderPlan,
    tile: Tile,
    levels: Demanded,
    around: Surroundings | None,
    counts: Counter[str],
    limit: TimeLimit | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """The arrays of `coverage.Cover` for the pixels whose coverage rises."""
    rows, columns = np.nonzero(levels.covered)
    sizes = levels.cover[rows, columns]
    values = np.empty((8, rows.size), dtype=np.float32)
    for size in np.unique(sizes).tolist():
        assert around is not None
        alike = np.flatnonzero(sizes == size)
        for part in _batches(columns[alike], rows[alike], int(COVERAGES[size]), limit):
            chosen = alike[part]
            nearby = around.nearby(rows[chosen], columns[chosen])
            x, y = columns[chosen] + tile.x0, rows[chosen] + tile.y0
            found = cover(plan.look or plan, size, x, y, nearby, counts)
            values[:, chosen] = np.vstack((found.values, found.known, found.spread, found.doubts))
    return values[:3], values[3:6], values[6], values[7]


def _samples(
    plan: RenderPlan,
    tile: Tile,
    levels: Demanded,
    around: Surroundings | None,
    counts: Counter[str],
    limit: TimeLimit | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32], Masks]:
    rows, columns = np.nonzero(levels.sampled)
    first, last = COUNTS[levels.have[rows, columns]], COUNTS[levels.want[rows, columns]]
    guided = levels.guided[rows, columns]
    halves = np.empty((HALVES, 3, rows.size), dtype=np.float32)
    squares = np.empty(rows.size, dtype=np.float32)
    controlled = guided.copy()
    for chosen in _batches(columns, rows, last - first, limit):
        x, y = columns[chosen] + tile.x0, rows[chosen] + tile.y0
        counted = last[chosen] - first[chosen]
        found = _radiance(plan, x, y, first[chosen], last[chosen], counts)
        if around is not None:
            _subtract_guides(plan, found, around, rows[chosen], columns[chosen], guided[chosen], counted)
            plain = np.flatnonzero(~guided[chosen])
            tinted = _subtract_tints(plan, found, around, rows[chosen], columns[chosen], plain, counted)
            controlled[chosen[tinted]] = True
        starts = np.cumsum(counted) - counted
        for count in np.unique(counted).tolist():
            alike = np.flatnonzero(counted == count)
            samples = found.radiance[:, starts[alike][:, None] + np.arange(count)]
            halves[:, :, chosen[alike]], squares[chosen[alike]] = _reduced(samples)
    return halves, squares, controlled


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """What camera rays found: radiance (3, N), labels (N,) and colours (3, N) of what they met."""

    radiance: Floats
    labels: NDArray[np.int32]
    colors: Floats


def _subtract_guides(
    plan: RenderPlan,
    found: _Found,
    around: Surroundings,
    rows: Integers,
    columns: Integers,
    guided: Masks,
    counted: Integers,
) -> None:
    """Take the guide from the samples of those pixels (n,) that have one, with `counted` samples each."""
    if not guided.any():
        return
    nearby = around.nearby(rows[guided], columns[guided])
    rays = np.flatnonzero(guided.repeat(counted))
    pixels = np.arange(nearby.labels.shape[1]).repeat(counted[guided])
    known, _ = guide(nearby, plan.rough | plan.textured).at(found.labels[rays], pixels)
    add(found.radiance, rays, -known)


def _subtract_tints(
    plan: RenderPlan,
    found: _Found,
    around: Surroundings,
    rows: Integers,
    columns: Integers,
    others: Integers,
    counted: Integers,
) -> Integers:
    """Take the colour of textures from the samples of those pixels that are filled by one; gives which.

    `others` are those of the pixels (n,) that have no guide.
    """
    if not plan.tinted.any():
        return others[:0]
    tints = around.tints(rows[others], columns[others], plan.tinted)
    which = np.full(rows.size, -1)
    which[others[tints.pixels]] = np.arange(tints.pixels.size)
    which = which.repeat(counted)
    rays = np.flatnonzero(which >= 0)
    control = tints.at(which[rays], found.labels[rays], taken(found.colors, rays))
    add(found.radiance, rays, -control)
    return others[tints.pixels]


def _radiance(
    plan: RenderPlan, x: Integers, y: Integers, first: Integers, last: Integers, counts: Counter[str]
) -> _Found:
    """The samples `first` to `last` (n,) of pixels (n,), those of a pixel together."""
    count = last - first
    columns, rows = x.repeat(count), y.repeat(count)
    numbers = np.arange(count.sum()) - (np.cumsum(count) - count - first).repeat(count)
    place = places(plan.seed, rows * plan.width + columns, numbers)
    rays = camera_rays(plan, columns, rows, numbers, place)
    seen = Surfaces.none(numbers.size)
    found = np.minimum(radiance(plan, rays, counts, seen), BRIGHTEST)
    return _Found(found, labels_of(rays.shapes), seen.colors)


def _reduced(found: Floats) -> tuple[Floats, Floats]:
    """Means of the halves (2, 3, n), and sums of squares (n,), of samples (3, n, count)."""
    samples = np.ascontiguousarray(found.transpose(2, 0, 1))
    count = len(samples)
    halves = np.stack(
        [halving_sum(samples[half::HALVES].copy()) / (count // HALVES) for half in range(HALVES)]
    )
    samples -= halves.mean(axis=0)
    np.multiply(samples, samples, out=samples)
    return halves, halving_sum(samples).sum(axis=0) / 3


def _batches(
    columns: Integers, rows: Integers, count: Integers | int, limit: TimeLimit | None
) -> Iterator[Integers]:
    """Portions of pixels with `count` rays each, neighbours together.

    Pixels of all counts share a portion: calls are most of the price of few rays.
    """
    order = np.argsort(morton.codes(columns, rows), kind="stable")
    rays = np.broadcast_to(count, order.shape)[order]
    return (order[part] for part in portions(rays, limit))
