"""Requests of the first passes: nodes of lattices, coverage of border pixels, and probes."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.allocation import DECAY, cover_sizes
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.guides import MIN_ALBEDO, surroundings
from renderer.adaptive.labels import borders, dilate, of_labels, of_lights, rim
from renderer.adaptive.lattice import (
    INTERPOLATED_NOISE,
    NODE,
    Picture,
    interpolate,
    interpolate_labels_once,
    interpolate_once,
    interpolation_axes,
    interpolation_errors,
)
from renderer.adaptive.levels import PREVIEWED, SAMPLED, Levels, levels_of, node_level
from renderer.math.arrays import Floats, Masks
from schemas.tiles import Tile

BORDER_BUDGET_SHARE = 0.75
"""Share of the budget for the coverage of border pixels. With all of it random pictures keep their targets as
well, but estimate their error worse where a hard shadow falls on a ball."""

MIN_LIGHT_EDGE_COVERAGE = 6
"""Least number of `levels.COVERAGES` of pixels that edges of visible lights cross: 42 rays, as no pilot
sample may hit a small light. With 4 rays, lamps of a third of a pixel, 20 times as bright as white and partly
hidden, made the true error 1.6/255 where 0.73/255 was reported."""

CONTACT_ERROR_SHARE = 2.0**-6
"""Expected squared error of the radiance at a border, as a share of its contrast: contact shadows that end
there, which pilot samples beside the border miss."""

MEAN_OVER_MAX_SQUARE = np.float32(0.5)
"""Mean squared error between nodes over the square of the largest predicted one: 8 / 15 for a parabola."""

MIN_PROBE_SHARE, MAX_PROBE_SHARE = 2.0**-8, 2.0**-2
"""Bounds of the least share of pixels that are probes, for coarse and for fine errors."""

PROBE_DENSITY = 2.0**-15
"""The least share times the error aimed at: one pixel in 128 is a probe for an error of 1/256."""

FIRST_PROBE_LEVEL, MAX_PROBE_LEVEL = SAMPLED + 1, 9
"""Levels of new probes: from 8 samples to 256."""

FOOTPRINT_ERROR_SHARE = np.float32(2.0**-10)
"""Error of a texture's mean over a pixel relative to that of a point look-up, squared: means are over
parallelograms, which distant pixels are only roughly."""

LENS_PROBE_FACTOR = 2
"""Factor on the probes through a lens: noisy nodes predict the error between them less well."""

LENS_BUDGET_CAP = 4.0
"""Through a lens, largest sum of expected errors that probes are distributed by, in budgets: beyond it
samples come first."""


def refine(estimate: Estimate) -> None:
    """Interpolate where the lattice is smooth, and request nodes at half its stride elsewhere."""
    take_nodes(estimate)
    stride = estimate.stride
    nodes, finer = np.s_[::stride, ::stride], np.s_[:: stride // 2, :: stride // 2]
    across, along = lattice_errors(estimate, stride, noise(estimate))
    axes = interpolation_axes(across, along, estimate.labels[nodes], estimate.have[finer].shape, estimate.aim)
    axes[near_thin(estimate, stride if estimate.piloted else stride // 2)[finer]] = NODE
    fresh = axes == NODE
    fresh[::2, ::2] = False
    _guess(estimate, np.maximum(across, along), stride)
    interpolate_once(estimate.values[:, *finer], axes)
    interpolate_labels_once(estimate.labels[finer], axes)
    axes[::2, ::2] = estimate.axes[nodes]
    estimate.axes[finer] = axes
    estimate.stride = stride // 2
    _ask_for_nodes(estimate, fresh)


def _ask_for_nodes(estimate: Estimate, fresh: Masks) -> None:
    """Request nodes of the lattice; once complete, also pixels that no neighbour need reveal."""
    stride = estimate.stride
    estimate.want[...] = 0
    estimate.want[::stride, ::stride][fresh] = PREVIEWED if estimate.piloted else node_level(estimate.aim)
    if not estimate.piloted:
        estimate.shown[::stride, ::stride][fresh] = True
        stratify(estimate, expected_errors(estimate))
    elif stride == 1:
        estimate.want[
            (_marked(estimate, estimate.plan.edges) | _thin_shadows(estimate)) & (estimate.have < PREVIEWED)
        ] = PREVIEWED


def take_nodes(estimate: Estimate) -> None:
    """Set the values of sampled nodes to the means of their samples, and interpolate between them."""
    if estimate.piloted:
        return
    nodes = estimate.shown & (estimate.have >= SAMPLED)
    for value, halves in zip(estimate.values, estimate.halves.transpose(1, 0, 2, 3), strict=True):
        np.copyto(value, (halves[0] + halves[1]) / 2, where=nodes, casting="same_kind")
    estimate.axes[estimate.shown] = NODE
    interpolate(estimate.values, estimate.axes, estimate.coarsest)


def lattice_errors(
    estimate: Estimate, stride: int, squares: Floats
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Errors of interpolation beside the nodes of a lattice, less the nodes' noise (H, W), squared."""
    nodes = np.s_[::stride, ::stride]
    labels = estimate.labels[nodes]
    across, along = interpolation_errors(np.clip(estimate.values[:, *nodes], 0, 1), labels)
    fine = of_labels(estimate.plan.fine, labels)
    explained = np.sqrt(squares[nodes]).astype(np.float32)
    across, along = (np.where(fine, np.inf, np.maximum(found - explained, 0)) for found in (across, along))
    return across, along


def _guess(estimate: Estimate, errors: NDArray[np.float32], stride: int) -> None:
    """Initialize the values and expected errors of the finer lattice with those of the nodes before them."""
    finer, nodes = np.s_[:: stride // 2, :: stride // 2], np.s_[::stride, ::stride]
    height, width = estimate.have[finer].shape
    between = np.ones((height, width), dtype=bool)
    between[::2, ::2] = False
    squares = MEAN_OVER_MAX_SQUARE * np.minimum(errors, 1) ** 2
    pairs = [(estimate.expected_error[finer], squares)]
    pairs += [(value[finer], value[nodes]) for value in estimate.values]
    for target, coarse in pairs:
        filled = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
        np.copyto(target, filled, where=between)


def variances(estimate: Estimate) -> Floats:
    """Variances of single samples at nodes, mean over channels, (H, W); 0 elsewhere."""
    found = np.zeros(estimate.have.shape)
    if not estimate.piloted:
        nodes = np.flatnonzero(estimate.shown & (estimate.have >= SAMPLED))
        found.ravel()[nodes] = estimate.variances(nodes)
    return found


def noise(estimate: Estimate) -> Floats:
    """Variance of nodes and of values interpolated between them, (H, W): 0 for pilot samples.

    Scaled to explain the sum of the squared differences of the nodes' halves.
    """
    found = variances(estimate)
    nodes = np.flatnonzero(found)
    if not nodes.size:
        return found
    squares = found.ravel()[nodes] * estimate.samples(nodes) ** -DECAY
    apart = np.diff(np.clip(estimate.halves.reshape(2, 3, -1)[:, :, nodes], 0, 1), axis=0)[0]
    found.ravel()[nodes] = squares * (apart**2).mean(axis=0).sum() / (4 * squares.sum())
    interpolate(found, estimate.axes, estimate.coarsest)
    found *= np.where(estimate.axes == NODE, 1.0, INTERPOLATED_NOISE)
    return found


def _marked(estimate: Estimate, pixels: NDArray[np.int64]) -> Masks:
    marks = np.zeros(estimate.have.shape, dtype=bool)
    marks[pixels[1], pixels[0]] = True
    return marks


def _thin_shadows(estimate: Estimate) -> Masks:
    """Pixels that thin shadows may cross, (H, W)."""
    columns, rows, shapes = estimate.plan.thin_shadows
    there = estimate.labels[rows, columns] == shapes
    return _marked(estimate, np.stack((columns[there], rows[there])))


def near_thin(estimate: Estimate, reach: int) -> Masks:
    """Pixels within `reach` of shapes that may lie between nodes of the lattice, (H, W)."""
    near = _marked(estimate, estimate.plan.thin)
    return dilate(near, reach) if near.any() else near


def cover_borders(estimate: Estimate) -> None:
    """Request the coverage of pixels that may show several shapes, with more rays where contrast is higher.

    The outermost pixels are among them, as no neighbour reveals an edge in their outer half. Pilot samples
    are stored apart: unlike the means that border pixels will show, they predict the error of the pixels
    beside them, as of a shadow's edge between the two.
    """
    np.copyto(estimate.pilots, estimate.values, where=estimate.coverage == 0)
    seen, unseen = borders(estimate.labels), _marked(estimate, estimate.plan.edges) | near_thin(estimate, 1)
    outermost = rim(estimate.have.shape)
    rows, columns = np.nonzero(seen | unseen | outermost)
    height, width = estimate.have.shape
    nearby = surroundings(Tile(0, 0, 0, width, height), estimate.around).nearby(rows, columns)
    contrasts = nearby.contrasts()
    typical = contrasts[seen[rows, columns]].mean() if seen.any() else 0.0
    contrasts = np.maximum(contrasts, typical * unseen[rows, columns])
    estimate.contrasts[rows, columns] = contrasts
    estimate.expected_error[rows, columns] = nearby.unevenness()
    sizes = cover_sizes(contrasts, BORDER_BUDGET_SHARE * estimate.budget)
    estimate.cover[rows, columns] = np.maximum(sizes, (unseen | outermost)[rows, columns])
    columns, rows = estimate.plan.lamps
    estimate.cover[rows, columns] = np.maximum(estimate.cover[rows, columns], MIN_LIGHT_EDGE_COVERAGE)


def choose_probes(estimate: Estimate) -> None:
    """Divide pixels into strata and request probes of each."""
    expected = expected_errors(estimate)
    stratify(estimate, expected)
    if estimate.piloted:
        _sample_what_pilots_miss(estimate)
    raise_probe_probability(estimate, expected)
    estimate.want[...] = probe_levels(estimate) * probes(estimate)
    np.maximum(estimate.want, node_level(estimate.aim), out=estimate.want, where=estimate.shown)


def expected_errors(estimate: Estimate) -> NDArray[np.float32]:
    """Expected squared errors of pixels without samples of their own, (H, W)."""
    if not estimate.piloted:
        return (noise(estimate) + estimate.expected_error).astype(np.float32)
    plan, labels = estimate.plan, estimate.labels
    expected = strata.expected_errors(estimate.pilots)
    if plan.averaged.any():
        _leave_textures_out(estimate, expected)
    covered = estimate.cover > 0
    np.copyto(
        expected, np.maximum(estimate.expected_error, CONTACT_ERROR_SHARE * estimate.contrasts), where=covered
    )
    np.maximum(expected, estimate.expected_error, out=expected, where=of_labels(plan.detailed, labels))
    return expected


def stratify(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Divide pixels into strata by what they show and by their expected error (H, W)."""
    plan = estimate.plan
    fine = of_labels(plan.unaveraged | plan.detailed, estimate.labels)
    kinds = np.where(estimate.cover > 0, strata.BORDER, strata.EVEN * (estimate.have > 0))
    kinds[fine & (estimate.have > 0)] = strata.NEEDS_SAMPLING
    estimate.strata[...] = strata.strata_of(expected, kinds)


def raise_probe_probability(estimate: Estimate, expected: Picture) -> None:
    """Raise the share of probes to what the aim needs for expected squared errors (H, W)."""
    if not estimate.piloted:
        much = float(expected.sum()) / (LENS_BUDGET_CAP * estimate.budget)
        expected = expected / np.float32(max(much, 1.0))
    share = float(np.clip(PROBE_DENSITY / estimate.aim, MIN_PROBE_SHARE, MAX_PROBE_SHARE))
    wanted = strata.probe_probability(estimate.strata, expected, share, estimate.budget)
    if not estimate.piloted:
        wanted = np.minimum(LENS_PROBE_FACTOR * wanted, 1.0)
    np.maximum(estimate.probe_probability, wanted, out=estimate.probe_probability)


def probes(estimate: Estimate) -> Masks:
    """Mask of probes, (H, W): pixels with a rank below the probability of their stratum."""
    ranks = strata.probe_ranks(estimate.plan.seed, estimate.have.shape)
    return ranks < estimate.probe_probability[estimate.strata]


def probe_levels(estimate: Estimate) -> Levels:
    """Levels of new probes, (H, W), at which their noise is at most the expected error."""
    found = variances(estimate)
    interpolate(found, estimate.axes, estimate.coarsest)
    expected = np.maximum(strata.typical_error(estimate.strata), estimate.aim**2)
    levels = levels_of((found / expected) ** (2 / 3))
    return np.clip(levels, FIRST_PROBE_LEVEL, MAX_PROBE_LEVEL).astype(np.uint8)


def _sample_what_pilots_miss(estimate: Estimate) -> None:
    """Show samples where thin shadows may fall, and at borders of what is brighter than white.

    There a small share of a pixel makes it white; that of visible lights is known.
    """
    tinted = of_labels(estimate.plan.tinted, estimate.labels) & ~borders(estimate.labels)
    estimate.controlled |= tinted & (estimate.cover == 0)
    found, bright = _thin_shadows(estimate), (estimate.pilots.max(axis=0) > 1) & ~of_lights(estimate.labels)
    if bright.any():
        found |= (estimate.cover > 0) & dilate(bright, 1) & dilate(~bright, 1)
    estimate.shown |= found
    estimate.strata[found] = (
        estimate.strata[found] % strata.STEPS_PER_KIND + strata.STEPS_PER_KIND * strata.OUTLIER
    )


def _leave_textures_out(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Replace the expected error of textures with a known mean by that of the light on them.

    Away from borders only, where the pilot samples around tell the light.
    """
    colors = np.maximum(estimate.colors, np.float32(MIN_ALBEDO))
    unlike = of_labels(estimate.plan.averaged, estimate.labels) & ~borders(estimate.labels)
    lit = np.divide(estimate.pilots, colors, dtype=np.float32)
    light = strata.expected_errors(lit)
    light *= (colors**2).mean(axis=0)
    np.maximum(light, FOOTPRINT_ERROR_SHARE * expected, out=light)
    np.copyto(expected, light, where=unlike)
