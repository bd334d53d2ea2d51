"""Render a tile of an adaptive pass: a pure function of the plan and the request."""

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.coverage import cover
from renderer.adaptive.guides import Surroundings
from renderer.adaptive.labels import labels_of, of_labels
from renderer.adaptive.levels import COUNTS, COVERAGES
from renderer.adaptive.requests import Samples, TileRequest
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.time_limits import TimeLimit, portions
from renderer.film import BRIGHTEST
from renderer.halves import HALVES, places
from renderer.integrator import WORK_COUNTERS, FirstHits, radiance, rays_through, render_layers
from renderer.math import morton
from renderer.math.arrays import Floats, Integers, Masks, add, taken
from renderer.math.numerics import halving_sum


def render_request(plan: TargetPlan, request: TileRequest) -> Samples:
    """Render a request, its layers included.

    Raises
    ------
    OutOfTimeError
        If the request's limit is reached; the tile is lost.
    """
    samples = render_samples(plan, request)
    if not request.records:
        return samples
    begun = time.process_time()
    records, counts = render_layers(plan, request.tile)
    work = {name: samples.work[name] + counts.pop(name, 0) for name in WORK_COUNTERS}
    seconds = time.process_time() - begun
    return replace(samples, counts=samples.counts | counts, work=work, layers=records, layer_seconds=seconds)


def render_samples(plan: TargetPlan, request: TileRequest) -> Samples:
    """Bring the pixels of a tile from the levels that they have to those that are wanted.

    Results do not depend on how the picture is cut into tiles.

    Parameters
    ----------
    plan : TargetPlan
        Of target quality.
    request : TileRequest

    Raises
    ------
    OutOfTimeError
        If the request's limit is reached; the tile is lost.
    """
    begun = time.process_time()
    counts: Counter[str] = Counter(
        camera=0, shadow=0, mirror=0, transmission=0, **dict.fromkeys(WORK_COUNTERS, 0)
    )
    pilots, labels, seen = _pilot_samples(plan, request, counts)
    covers = _covers(plan, request, counts)
    if request.around is not None:
        rows, columns = np.nonzero(request.levels.covered)
        around = request.around.with_others(rows, columns, covers[1])
        request = replace(request, around=around)
    samples = _samples(plan, request, counts)
    work = {name: counts.pop(name) for name in WORK_COUNTERS}
    seconds = time.process_time() - begun
    colors, shading_errors = seen.colors.astype(np.float32), seen.shading_error.astype(np.float32)
    return Samples(pilots, labels, colors, shading_errors, *covers, *samples, dict(counts), work, seconds)


def _pilot_samples(
    plan: TargetPlan, request: TileRequest, counts: Counter[str]
) -> tuple[NDArray[np.float32], NDArray[np.int32], FirstHits]:
    pilot_plan, textured = plan.pilot or plan, plan.textured
    rows, columns = np.nonzero(request.levels.previewed)
    values = np.empty((3, rows.size), dtype=np.float32)
    labels = np.empty(rows.size, dtype=np.int32)
    found = FirstHits.none(rows.size)
    middle = np.full(rows.size, 0.5)
    for chosen in _batches(columns, rows, 1, request.limit):
        x, y = columns[chosen] + request.tile.x0, rows[chosen] + request.tile.y0
        rays = rays_through(pilot_plan, x, y, np.full(x.size, HALVES), (middle[chosen], middle[chosen]))
        seen = FirstHits.none(x.size)
        values[:, chosen] = np.minimum(
            radiance(pilot_plan, rays, counts, seen, until=request.limit.until), BRIGHTEST
        )
        labels[chosen] = labels_of(rays.shapes)
        np.copyto(seen.colors, 1.0, where=~of_labels(textured, labels[chosen]))
        found.colors[:, chosen], found.shading_error[chosen] = seen.colors, seen.shading_error
    return values, labels, found


def _covers(
    plan: TargetPlan, request: TileRequest, counts: Counter[str]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Values, others and variances, as of `coverage.cover`, of the pixels whose coverage rises."""
    rows, columns = np.nonzero(request.levels.covered)
    sizes = request.levels.cover[rows, columns]
    values = np.empty((7, rows.size), dtype=np.float32)
    for size in np.unique(sizes).tolist():
        assert request.around is not None
        alike = np.flatnonzero(sizes == size)
        for part in _batches(columns[alike], rows[alike], int(COVERAGES[size]), request.limit):
            chosen = alike[part]
            nearby = request.around.nearby(rows[chosen], columns[chosen])
            x, y = columns[chosen] + request.tile.x0, rows[chosen] + request.tile.y0
            values[:, chosen] = cover(plan, size, x, y, nearby, counts, until=request.limit.until)
    return values[:3], values[3:6], values[6]


def _samples(
    plan: TargetPlan, request: TileRequest, counts: Counter[str]
) -> tuple[NDArray[np.float32], NDArray[np.float32], Masks]:
    """Means of halves, sums of squares, and which pixels are controlled: the last arrays of `Samples`."""
    levels = request.levels
    rows, columns = np.nonzero(levels.sampled)
    first, last = COUNTS[levels.have[rows, columns]], COUNTS[levels.want[rows, columns]]
    guided = levels.guided[rows, columns]
    halves = np.empty((HALVES, 3, rows.size), dtype=np.float32)
    squares = np.empty(rows.size, dtype=np.float32)
    controlled = guided.copy()
    for chosen in _batches(columns, rows, last - first, request.limit):
        x, y = columns[chosen] + request.tile.x0, rows[chosen] + request.tile.y0
        batch = _radiance(plan, x, y, first[chosen], last[chosen], counts, request.limit.until)
        if request.around is not None:
            place = rows[chosen], columns[chosen]
            controlled[chosen] = _subtract_controls(plan, batch, request.around, place, guided[chosen])
        for count in np.unique(batch.counts).tolist():
            alike = np.flatnonzero(batch.counts == count)
            halves[:, :, chosen[alike]], squares[chosen[alike]] = _reduced(batch.of(alike, count))
    return halves, squares, controlled


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    """Samples of n pixels, N in all, those of a pixel together.

    Attributes
    ----------
    counts : (n,) int64
        Samples of each pixel.
    radiance : (3, N) float64
        Control variates are subtracted from it in place.
    labels : (N,) int32
    colors : (3, N) float64
        Of the rays' first hits.
    """

    counts: Integers
    radiance: Floats
    labels: NDArray[np.int32]
    colors: Floats

    def of(self, pixels: Integers, count: int) -> Floats:
        """Radiance (3, m, count) of pixels (m,) with `count` samples each."""
        starts = (np.cumsum(self.counts) - self.counts)[pixels]
        return self.radiance[:, starts[:, None] + np.arange(count)]


def _subtract_controls(
    plan: TargetPlan,
    batch: _Batch,
    around: Surroundings,
    place: tuple[Integers, Integers],
    guided: Masks,
) -> Masks:
    """Subtract control variates of the pixels (n,) at rows and columns of the tile; returns which have one.

    Those `guided` (n,) have that of borders, those that a texture with a known mean fills that of its colour.
    """
    tinted = ~guided & around.nearby(*place).filled_by(plan.tinted)
    for chosen in (guided, tinted):
        pixels = np.flatnonzero(chosen)
        if pixels.size:
            nearby = around.nearby(*(each[pixels] for each in place))
            which, rays = _rays_of(batch, pixels)
            labels = batch.labels[rays]
            control = (
                nearby.radiance_of(labels, which, plan.fine, plan.unshaded.lights)
                if chosen is guided
                else nearby.textured(labels, which, taken(batch.colors, rays))
            )
            add(batch.radiance, rays, -control)
    return guided | tinted


def _rays_of(batch: _Batch, pixels: Integers) -> tuple[Integers, Integers]:
    """For some pixels (m,) of a batch: which of the m each ray belongs to (M,), and the rays (M,)."""
    which = np.full(batch.counts.size, -1)
    which[pixels] = np.arange(pixels.size)
    which = which.repeat(batch.counts)
    rays = np.flatnonzero(which >= 0)
    return which[rays], rays


def _radiance(
    plan: TargetPlan,
    x: Integers,
    y: Integers,
    first: Integers,
    last: Integers,
    counts: Counter[str],
    until: float,
) -> _Batch:
    """Samples `first` to `last` (n,) of pixels (n,)."""
    count = last - first
    columns, rows = x.repeat(count), y.repeat(count)
    numbers = np.arange(count.sum()) - (np.cumsum(count) - count - first).repeat(count)
    place = places(plan.seed, plan.camera.numbers(columns, rows), numbers)
    rays = rays_through(plan, columns, rows, numbers, place)
    seen = FirstHits.none(numbers.size)
    found = np.minimum(radiance(plan, rays, counts, seen, until=until), BRIGHTEST)
    return _Batch(count, found, labels_of(rays.shapes), seen.colors)


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
    columns: Integers, rows: Integers, count: Integers | int, limit: TimeLimit
) -> Iterator[Integers]:
    """Batches of pixels with `count` rays each, neighbours together.

    Pixels of different counts share a batch: for few rays most of the cost is calls.
    """
    order = np.argsort(morton.codes(columns, rows), kind="stable")
    rays = np.broadcast_to(count, order.shape)[order]
    return (order[part] for part in portions(rays, limit))
