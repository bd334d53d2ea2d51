"""Coverage of border pixels: unshaded rays find the share of each shape, pilot samples nearby its radiance.

Within such a pixel the visible shape varies, and the radiance of each shape hardly. A shape that no pilot
sample around has hit is shaded once. The rays form two independent Fibonacci lattices, whose difference
estimates the error of the shares.
"""

from collections import Counter
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.guides import Nearby
from renderer.adaptive.labels import labels_of, of_lights
from renderer.adaptive.lamps import pieces_of
from renderer.adaptive.levels import COVERAGES, FIBONACCI
from renderer.adaptive.target_plan import TargetPlan
from renderer.film import BRIGHTEST
from renderer.halves import HALVES
from renderer.integrator import find_hits, radiance, rays_through
from renderer.interaction import EMITTER
from renderer.lights.emitters import PIXEL_DIMENSIONS
from renderer.math.arrays import Floats, Integers, Masks, put, taken
from renderer.math.streams import bits, keys, uniforms
from renderer.plan.plan import RenderPlan

GENERATORS = dict(zip(FIBONACCI, (1, *FIBONACCI), strict=False))
"""Generators z of Fibonacci lattices of n points (i / n, i z / n): the Fibonacci number before n."""


def places(seed: int, pixels: Integers, count: int) -> tuple[Floats, Floats]:
    """Positions of rays in pixels (n,), two arrays (n, 2, count) in [0, 1): two randomly shifted lattices.

    Their random streams follow those of the halves of samples.
    """
    key = keys(seed, PIXEL_DIMENSIONS, pixels[:, None], HALVES + np.arange(HALVES))
    index = np.arange(count)
    across = index / count + uniforms(bits(key, 0))[:, :, None]
    along = index * GENERATORS[count] / count + uniforms(bits(key, 1))[:, :, None]
    return across - np.floor(across), along - np.floor(along)


@dataclass(frozen=True, slots=True, eq=False)
class _Parts:
    """Parts of lattices with one visible shape each: m parts, those of one lattice together.

    Attributes
    ----------
    lattices : (m,) int64
        Number of the lattice; each pixel has two.
    shares : (m,) float64
        Of the lattice.
    rays : (m,) int64
        The ray nearest to the centre of the part.
    """

    lattices: Integers
    shares: Floats
    rays: Integers


def _lamps(
    pilot: RenderPlan, x: Integers, y: Integers, place: tuple[Floats, Floats], counts: Counter[str]
) -> tuple[Floats, Floats]:
    """Shares (2 n,) of visible lights in pixels (n,), and their radiance (3, 2 n), by each lattice.

    Areas are known from outlines; rays at positions (2 n, k) of the unit square in each find what is hidden.
    """
    pieces = pieces_of(pilot.camera, pilot.visible_lights, x, y)
    lattices = pieces.pixels[:, None] * HALVES + np.arange(HALVES)
    count = place[0].shape[1]
    there = [axis[lattices].reshape(-1, HALVES * count) for axis in place]
    across, along = pieces.places(*there)
    of_rays = pieces.pixels.repeat(across.shape[1])
    hits = _hits(pilot, x[of_rays], y[of_rays], (across.ravel(), along.ravel()), counts)
    seen = hits.reshape(-1, HALVES, count) == EMITTER + pieces.lights[:, None, None]
    shares = pieces.areas()[:, None] * seen.mean(axis=2)
    colors = np.minimum(pilot.unshaded.lights[:, pieces.lights], BRIGHTEST)
    covered, *radiance = (
        np.bincount(lattices.ravel(), (color * shares).ravel(), HALVES * x.size)
        for color in (1.0, *colors[:, :, None])
    )
    return np.minimum(covered, 1.0), np.stack(radiance)


def _beside_lamps(parts: _Parts, lamps: Masks, covered: Floats) -> Floats:
    """Shares of parts (m,) in what lights, which cover known shares (2 n,), leave; parts `lamps` get 0."""
    others = np.bincount(parts.lattices, parts.shares * ~lamps, minlength=covered.size)
    left = np.divide(1 - covered, others, out=1 - covered, where=others > 0)
    alone = (others == 0)[parts.lattices]
    return parts.shares * left[parts.lattices] * (~lamps | alone)


def _hits(
    pilot: RenderPlan, x: Integers, y: Integers, place: tuple[Floats, Floats], counts: Counter[str]
) -> Integers:
    """Shapes (m,) hit by rays through positions (m,) in pixels (m,)."""
    if not x.size:
        return np.zeros(0, dtype=np.int64)
    rays = rays_through(pilot, x, y, np.full(x.size, HALVES), place)
    find_hits(pilot, rays)
    counts["camera"] += x.size
    return rays.shapes


def cover(
    plan: TargetPlan,
    size: int,
    x: Integers,
    y: Integers,
    nearby: Nearby,
    counts: Counter[str],
    *,
    until: float = inf,
) -> NDArray[np.float32]:
    """Measure the coverage of pixels (n,) with `COVERAGES[size]` rays each.

    Returns
    -------
    (7, n) float32
        Mean radiance; radiance of shapes that no pilot sample around has hit, as in `guides.Surroundings`;
        and squared standard error, mean over channels, of the first clipped to 0..1 due to the shares.

    Raises
    ------
    OutOfTimeError
        If rays are left at the time `until`.
    """
    pilot = plan.pilot or plan
    count = int(COVERAGES[size]) // HALVES
    across, along = (
        place.reshape(-1, count) for place in places(plan.seed, plan.camera.numbers(x, y), count)
    )
    of_rays = np.arange(x.size).repeat(HALVES * count)
    shapes = _hits(pilot, x[of_rays], y[of_rays], (across.ravel(), along.ravel()), counts)
    parts = _parts(shapes.reshape(-1, count), across, along)
    labels = labels_of(shapes[parts.rays])
    covered, lamps = _lamps(pilot, x, y, (across, along), counts)
    shares = _beside_lamps(parts, of_lights(labels), covered)
    pixels = parts.lattices // HALVES
    shown = nearby.radiance_of(labels, pixels, plan.fine, pilot.unshaded.lights)
    missing = np.flatnonzero(np.isnan(shown[0]))
    others = nearby.others.astype(np.float64)
    if missing.size:
        chosen = parts.rays[missing]
        there = (across.ravel()[chosen], along.ravel()[chosen])
        every = np.full(chosen.size, HALVES)
        seen = rays_through(pilot, x[of_rays[chosen]], y[of_rays[chosen]], every, there)
        shaded = np.minimum(radiance(pilot, seen, counts, until=until), BRIGHTEST)
        others = _mean_others(others, pixels[missing], shares[missing], shaded)
        put(shown, missing, taken(others, pixels[missing]))
    # The pixel's own pilot sample stands for what only samples will find.
    others = np.where(np.isnan(others), nearby.values[:, 4], others)
    values, variance = _means(parts.lattices, shown * shares, lamps)
    return np.vstack((values, others.astype(np.float32), variance))


def _mean_others(others: Floats, pixels: Integers, shares: Floats, radiance: Floats) -> Floats:
    """Others (3, n) with the mean radiance of parts (m,) added in pixels that have none yet."""
    count = others.shape[1]
    sums = np.stack([np.bincount(pixels, shares * channel, count) for channel in radiance])
    weights = np.bincount(pixels, shares, count)
    return np.where(weights > 0, sums / np.where(weights > 0, weights, 1.0), others)


def _means(
    lattices: Integers, shown: Floats, lamps: Floats
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Means (3, n) of pixels and variances (n,), from what parts (3, m) and `lamps` (3, 2 n) contribute."""
    starts = np.flatnonzero(np.diff(lattices, prepend=-1))
    means = np.add.reduceat(shown, starts, axis=-1)
    halves = (means + lamps).reshape(3, -1, HALVES)
    apart = np.clip(halves[:, :, 0], 0, 1) - np.clip(halves[:, :, 1], 0, 1)
    variance = (apart**2).mean(axis=0) / 4
    return halves.mean(axis=2).astype(np.float32), variance.astype(np.float32)


def _parts(shapes: Integers, across: Floats, along: Floats) -> _Parts:
    """Parts of lattices, from the shapes and positions of their rays, all (lattices, count)."""
    count = shapes.shape[1]
    order = np.argsort(shapes, axis=1, kind="stable")
    sorted_shapes = np.take_along_axis(shapes, order, axis=1)
    fresh = np.ones(shapes.shape, dtype=bool)
    fresh[:, 1:] = sorted_shapes[:, 1:] != sorted_shapes[:, :-1]
    starts = np.flatnonzero(fresh)
    sizes = np.diff(starts, append=shapes.size)
    rays = (order + np.arange(shapes.shape[0])[:, None] * count).ravel()
    away = np.zeros(shapes.size)
    for along_axis in (across, along):
        there = along_axis.ravel()[rays]
        middle = np.add.reduceat(there, starts) / sizes
        away += (there - middle.repeat(sizes)) ** 2
    nearest = np.minimum.reduceat(away, starts).repeat(sizes) == away
    first = np.flatnonzero(nearest)
    which = np.searchsorted(first, starts)
    return _Parts(starts // count, sizes / count, rays[first[which]])
