"""What the passes before the first samples ask for: pilot samples, rays at borders, and probes."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.allocation import cover_sizes
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.guides import DARKEST, surroundings
from renderer.adaptive.lattice import Picture, cells_of, fill
from renderer.adaptive.levels import PREVIEWED, SAMPLED
from renderer.adaptive.neighbours import borders, highest, outline, spread
from renderer.adaptive.rays import of_labels, of_lights
from renderer.math.arrays import Masks
from schemas.tiles import Tile

BORDERS = 0.75
"""Share of the budget for border pixels: rays find only roughly how much of them each shape fills."""

UNKNOWN = 2.0**-8
"""Contrast of borders if pilot samples found none in the whole picture."""

FAINT, RIM = 2.0**-7, 2.0**-4
"""Least contrasts of a border and of the outermost pixels, as shares of the borders' mean."""

LIT = 6
"""Least number of `levels.COVERAGES` of pixels that edges of visible lights pass: 42 rays. No pilot sample
knows their contrast where lights are small. With 4 rays, lamps of a third of a pixel, 20 times as bright as
white and partly hidden, made the true error 1.6/255 where 0.73/255 was reported."""

HIDDEN = 2.0**-6
"""Squared error to expect of the brightness at a border, as a share of its contrast: shadows end where things
touch, and pilot samples beside the border miss that."""

CALM = 2
"""Interpolation may be expected to err by this many times the target error. Mostly it errs by far less: the
least smooth place decides."""

FEWEST_PROBES, MOST_PROBES = 2.0**-8, 2.0**-2
"""Bounds of the least share of pixels that are probes, for a coarse error and for a fine one."""

PROBES_BY_AIM = 2.0**-15
"""That share times the error aimed at: one pixel in 128 is a probe for an error of 1/256."""

PROBED = SAMPLED + 1
"""Level of a new probe: 8 samples."""

WIDE = 2
"""Where something may be finer than a pixel, the largest expected error within so many pixels counts: the
pixel's own pilot sample may have missed it."""

BENT = np.float32(2.0**-10)
"""Share of a point look-up's squared error that a mean over the pixel leaves: means are over parallelograms,
and a distant pixel is not quite one."""

SHADED = np.float32(2.0**-4)
"""Square of the share of a shape's brightness that a shadow between pilot samples may hide: a quarter."""


def refine_preview(estimate: Estimate) -> None:
    """Interpolate where the lattice is smooth, and ask for pilot samples at half its stride elsewhere."""
    stride = estimate.stride
    nodes = np.s_[::stride, ::stride]
    cells = cells_of(
        estimate.values[:, *nodes],
        estimate.labels[nodes],
        (fine(estimate) | near_thin(estimate, stride))[nodes],
        CALM * estimate.aim,
    )
    half = stride // 2
    finer = np.s_[::half, ::half]
    estimate.want[...] = 0
    estimate.want[finer][fill(estimate.values[:, *finer], estimate.labels[finer], cells)] = PREVIEWED
    estimate.stride = half
    if half == 1:
        estimate.want[(_edges(estimate) | _shadow_edges(estimate)) & (estimate.have < PREVIEWED)] = PREVIEWED


def fine(estimate: Estimate) -> Masks:
    """Pixels that show something that may be finer than the lattice, (H, W)."""
    return of_labels(estimate.adaptive.fine, estimate.labels)


def _edges(estimate: Estimate) -> Masks:
    """Pixels that edges of flat shapes pass, (H, W)."""
    passed = np.zeros(estimate.have.shape, dtype=bool)
    columns, rows = estimate.adaptive.edges
    passed[rows, columns] = True
    return passed


def _shadow_edges(estimate: Estimate) -> Masks:
    """Pixels that edges of hard shadows pass, (H, W)."""
    passed = np.zeros(estimate.have.shape, dtype=bool)
    columns, rows, shapes = estimate.adaptive.shadow_edges
    there = estimate.labels[rows, columns] == shapes
    passed[rows[there], columns[there]] = True
    return passed


def near_thin(estimate: Estimate, reach: int) -> Masks:
    """Pixels so near to shapes that may lie between the nodes of the lattice, (H, W)."""
    near = np.zeros(estimate.have.shape, dtype=bool)
    columns, rows = estimate.adaptive.thin
    near[rows, columns] = True
    return spread(near, reach) if near.any() else near


def cover_borders(estimate: Estimate) -> None:
    """Ask for many rays where pixels may show more than one thing, for more where these differ more.

    The outermost pixels are among them: no neighbour shows an edge in their outer half. Pilot samples are
    kept: the means that borders are going to show say nothing about the pixels beside them, but the samples
    that they replace do, as of a shadow's edge between the two.
    """
    np.copyto(estimate.pilots, estimate.values)
    seen, unseen = borders(estimate.labels), _edges(estimate) | near_thin(estimate, 1)
    rim = outline(estimate.have.shape)
    rows, columns = np.nonzero(seen | unseen | rim)
    height, width = estimate.have.shape
    around = surroundings(Tile(0, 0, 0, width, height), estimate.values, estimate.labels, estimate.colors)
    contrasts = around.nearby(rows, columns).contrasts()
    typical = contrasts[seen[rows, columns]].mean() if seen.any() else UNKNOWN
    least = np.select((unseen[rows, columns], rim[rows, columns]), (1.0, RIM), FAINT)
    estimate.contrasts[rows, columns] = contrasts = np.maximum(contrasts, typical * least)
    sizes = cover_sizes(contrasts, BORDERS * estimate.budget)
    estimate.want[...] = 0
    estimate.cover[rows, columns] = np.maximum(sizes, (unseen | rim)[rows, columns])
    columns, rows = estimate.adaptive.lamps
    estimate.cover[rows, columns] = np.maximum(estimate.cover[rows, columns], LIT)


def choose_probes(estimate: Estimate) -> None:
    """Sort pixels into strata by what they show and by their expected error; ask for probes of each."""
    adaptive = estimate.adaptive
    tinted = of_labels(adaptive.tinted, estimate.labels) & ~borders(estimate.labels)
    np.copyto(estimate.known, estimate.values, where=tinted & (estimate.coverage == 0))
    covered = estimate.coverage > 0
    expected = strata.expected_errors(estimate.pilots)
    if adaptive.averaged.any():
        _leave_textures_out(estimate, expected)
    np.copyto(expected, np.maximum(estimate.doubts, HIDDEN * estimate.contrasts), where=covered)
    detailed = of_labels(adaptive.detailed, estimate.labels)
    np.maximum(expected, estimate.doubts, out=expected, where=detailed)
    needs_sampling = of_labels(adaptive.unaveraged, estimate.labels)
    np.copyto(expected, highest(expected, WIDE), where=needs_sampling)
    shadowed = _shadow_edges(estimate)
    np.maximum(expected, strata.step_error(estimate.pilots) * SHADED, out=expected, where=shadowed)
    estimate.strata[...] = strata.strata_of(expected, estimate.have, needs_sampling | detailed | shadowed)
    _sample_what_pilots_miss(estimate)
    raise_probe_probability(estimate, expected)
    estimate.want[...] = PROBED * (probes(estimate) | estimate.shown)


def raise_probe_probability(estimate: Estimate, expected: Picture) -> None:
    """Make as many pixels probes as the aim needs, where squared errors (H, W) are expected."""
    wanted = strata.probe_probability(estimate.strata, expected, probe_share(estimate), estimate.budget)
    np.maximum(estimate.probe_probability, wanted, out=estimate.probe_probability)


def probe_share(estimate: Estimate) -> float:
    """Least share of all pixels that are probes."""
    return float(np.clip(PROBES_BY_AIM / estimate.aim, FEWEST_PROBES, MOST_PROBES))


def _sample_what_pilots_miss(estimate: Estimate) -> None:
    """Show samples where pilot samples nearby say too little.

    Where something brighter than white ends, a small share of it is seen like a large one; of lights the
    share is known. A narrow round shape has no pixel inside that is shaded like its border.
    """
    bright = (estimate.pilots.max(axis=0) > 1) & ~of_lights(estimate.labels)
    found = np.zeros(estimate.have.shape, dtype=bool)
    columns, rows = estimate.adaptive.narrow
    found[rows, columns] = True
    if columns.size:
        found = spread(found, 1)
    if bright.any():
        found |= (estimate.coverage > 0) & spread(bright, 1) & spread(~bright, 1)
    if found.any():
        estimate.shown |= found
        estimate.strata[found] = estimate.strata[found] % strata.STEPS + strata.STEPS * strata.SUSPECT


def _leave_textures_out(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Expect of textures, whose mean the pilot sample took, little error: mostly of the light on them.

    Beside another shape the light is no guide.
    """
    colors = np.maximum(estimate.colors, np.float32(DARKEST))
    unlike = of_labels(estimate.adaptive.averaged, estimate.labels) & ~borders(estimate.labels)
    lit = np.divide(estimate.pilots, colors, dtype=np.float32)
    light = strata.expected_errors(lit)
    light *= (colors**2).mean(axis=0)
    np.maximum(light, BENT * expected, out=light)
    np.copyto(expected, light, where=unlike)


def probes(estimate: Estimate) -> Masks:
    """Pixels (H, W) that are probes: whose rank is below the probability of their stratum."""
    ranks = strata.probe_ranks(estimate.plan.seed, estimate.have.shape)
    return ranks < estimate.probe_probability[estimate.strata]
