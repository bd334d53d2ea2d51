"""Rendering what an adaptive pass asks of a tile."""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.camera_rays import camera_rays
from renderer.adaptive.coverage import Surroundings, cover
from renderer.adaptive.halves import HALVES, places
from renderer.adaptive.labels import labels_of, of_labels
from renderer.adaptive.levels import COUNTS, COVERED, LOOKED, Levels
from renderer.adaptive.time_limits import TimeLimit, portions
from renderer.arrays import Floats, Integers, Masks
from renderer.execute import WORK, Surfaces, radiance
from renderer.film import BRIGHTEST
from renderer.layers import Layers
from renderer.numerics import halving_sum
from renderer.plan import RenderPlan
from schemas.tiles import Tile


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
    covers : (3, k) float32
    doubts : (k,) float32
        Of pixels at borders (`coverage.Cover`).
    halves : (2, 3, m) float32
        Means of the new samples of either half.
    squares : (m,) float32
        Sum over the new samples of squares about their mean, mean over channels.
    counts, work : dict
    cpu_seconds : float
        As in `execute.TileResult`.
    layers : dict of str to array
        What the centres of pixels show, in the pass that records it.
    layer_seconds : float
        CPU seconds that this took besides.
    residues : (n,) float32
        Squared errors to expect of first looks that met what varies within the pixel at a few places.
    """

    looks: NDArray[np.float32]
    labels: NDArray[np.int32]
    colors: NDArray[np.float32]
    covers: NDArray[np.float32]
    doubts: NDArray[np.float32]
    halves: NDArray[np.float32]
    squares: NDArray[np.float32]
    counts: dict[str, int]
    work: dict[str, int]
    cpu_seconds: float
    layers: Layers = field(default_factory=dict)
    layer_seconds: float = 0.0
    residues: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, dtype=np.float32))


def render_samples(
    plan: RenderPlan,
    tile: Tile,
    have: Levels,
    want: Levels,
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
    have, want : (h, w) uint8
        A pixel whose wanted level is not higher is left alone.
    around : Surroundings, optional
        First looks; what pixels at borders are made of.
    limit : TimeLimit, optional

    Raises
    ------
    OutOfTimeError
        If the limit is reached: what was found by then is lost.
    """
    begun = time.process_time()
    counts: Counter[str] = Counter(camera=0, shadow=0, mirror=0, transmission=0, **dict.fromkeys(WORK, 0))
    looks, labels, found = _first_looks(plan, tile, (want == LOOKED) & (have < LOOKED), counts, limit)
    covers, doubts = _covers(plan, tile, (want == COVERED) & (have < COVERED), around, counts, limit)
    halves, squares = _samples(plan, tile, have, np.where(want > COVERED, want, 0), counts, limit)
    work = {name: counts.pop(name) for name in WORK}
    seconds = time.process_time() - begun
    return Samples(
        looks,
        labels,
        found.colors.astype(np.float32),
        covers,
        doubts,
        halves,
        squares,
        dict(counts),
        work,
        seconds,
        residues=found.doubts.astype(np.float32),
    )


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
    wanted: Masks,
    around: Surroundings | None,
    counts: Counter[str],
    limit: TimeLimit | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    rows, columns = np.nonzero(wanted)
    values = np.empty((3, rows.size), dtype=np.float32)
    doubts = np.empty(rows.size, dtype=np.float32)
    for chosen in _batches(columns, rows, plan.coverage, limit):
        assert around is not None
        nearby = around.nearby(rows[chosen], columns[chosen])
        x, y = columns[chosen] + tile.x0, rows[chosen] + tile.y0
        found = cover(plan.look or plan, plan.coverage, x, y, nearby, counts)
        values[:, chosen], doubts[chosen] = found.values, found.doubts
    return values, doubts


def _samples(
    plan: RenderPlan,
    tile: Tile,
    have: Levels,
    want: Levels,
    counts: Counter[str],
    limit: TimeLimit | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    rows, columns = np.nonzero(want > have)
    first, last = COUNTS[have[rows, columns]], COUNTS[want[rows, columns]]
    halves = np.empty((HALVES, 3, rows.size), dtype=np.float32)
    squares = np.empty(rows.size, dtype=np.float32)
    for chosen in _batches(columns, rows, last - first, limit):
        x, y = columns[chosen] + tile.x0, rows[chosen] + tile.y0
        found = _radiance(plan, x, y, first[chosen], last[chosen], counts)
        counted = last[chosen] - first[chosen]
        starts = np.cumsum(counted) - counted
        for count in np.unique(counted).tolist():
            alike = np.flatnonzero(counted == count)
            samples = found[:, starts[alike][:, None] + np.arange(count)]
            halves[:, :, chosen[alike]], squares[chosen[alike]] = _reduced(samples)
    return halves, squares


def _radiance(
    plan: RenderPlan, x: Integers, y: Integers, first: Integers, last: Integers, counts: Counter[str]
) -> Floats:
    """Radiance (3, N) of the samples `first` to `last` (n,) of pixels (n,), those of a pixel together."""
    count = last - first
    columns, rows = x.repeat(count), y.repeat(count)
    numbers = np.arange(count.sum()) - (np.cumsum(count) - count - first).repeat(count)
    place = places(plan.seed, rows * plan.width + columns, numbers)
    return np.minimum(radiance(plan, camera_rays(plan, columns, rows, numbers, place), counts), BRIGHTEST)


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
    order = np.argsort(_spread(columns) | _spread(rows) << 1, kind="stable")
    rays = np.broadcast_to(count, order.shape)[order]
    return (order[part] for part in portions(rays, limit))


def _spread(numbers: Integers) -> Integers:
    """The lower 16 bits of numbers at every other place: two of them make Morton's order."""
    numbers = numbers & 0xFFFF
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        numbers = (numbers | numbers << shift) & mask
    return numbers
