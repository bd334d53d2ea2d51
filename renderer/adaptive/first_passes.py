"""What the first passes of a picture ask for: nodes of lattices, rays at borders, and probes."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.allocation import cover_sizes
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.guides import DARKEST, surroundings
from renderer.adaptive.lattice import (
    LEFT,
    NODE,
    Picture,
    bends,
    interpolate,
    interpolate_once,
    label_once,
    ways_between,
)
from renderer.adaptive.levels import COUNTS, PREVIEWED, SAMPLED, Levels, levels_of, node_level
from renderer.adaptive.neighbours import borders, outline, spread
from renderer.adaptive.rays import of_labels, of_lights
from renderer.math.arrays import Floats, Masks
from schemas.tiles import Tile

BORDERS = 0.75
"""Share of the budget for border pixels: rays find only roughly how much of them each shape fills. With
all of it random pictures keep their targets as well, but know their error worse where a hard shadow falls on
a ball."""

LIT = 6
"""Least number of `levels.COVERAGES` of pixels that edges of visible lights pass: 42 rays. No pilot sample
knows their contrast where lights are small. With 4 rays, lamps of a third of a pixel, 20 times as bright as
white and partly hidden, made the true error 1.6/255 where 0.73/255 was reported."""

HIDDEN = 2.0**-6
"""Squared error to expect of the brightness at a border, as a share of its contrast: shadows end where things
touch, and pilot samples beside the border miss that."""

MEAN_SQUARE = np.float32(0.5)
"""Mean square of the error between nodes, over the square of the largest that bends predict: 8 / 15 for a
parabola."""

NOISY = 1.0
"""A second difference of up to this many standard deviations of a node's noise counts as straight."""

FEWEST_PROBES, MOST_PROBES = 2.0**-8, 2.0**-2
"""Bounds of the least share of pixels that are probes, for a coarse error and for a fine one."""

PROBES_BY_AIM = 2.0**-15
"""That share times the error aimed at: one pixel in 128 is a probe for an error of 1/256."""

PROBED, MOST_PROBED = SAMPLED + 1, 9
"""Levels of a new probe: from 8 samples to 256."""

BENT = np.float32(2.0**-10)
"""Share of a point look-up's squared error that a mean over the pixel leaves: means are over parallelograms,
and a distant pixel is not quite one."""

CLOSER_PROBES = 2
"""Times as many probes through a lens: less is known beforehand of what lies between noisy nodes."""

MUCH = 4.0
"""When probes are shared out there, expected errors count for at most this many times the budget: beyond
that, samples come first."""


def refine(estimate: Estimate) -> None:
    """Interpolate where the lattice is smooth, and ask for nodes at half its stride elsewhere."""
    take_nodes(estimate)
    stride = estimate.stride
    nodes, finer = np.s_[::stride, ::stride], np.s_[:: stride // 2, :: stride // 2]
    across, along = lattice_errors(estimate, stride, noise(estimate))
    ways = ways_between(across, along, estimate.labels[nodes], estimate.have[finer].shape, estimate.aim)
    ways[near_thin(estimate, stride if estimate.piloted else stride // 2)[finer]] = NODE
    fresh = ways == NODE
    fresh[::2, ::2] = False
    _guess(estimate, np.maximum(across, along), stride)
    interpolate_once(estimate.values[:, *finer], ways)
    label_once(estimate.labels[finer], ways)
    ways[::2, ::2] = estimate.ways[nodes]
    estimate.ways[finer] = ways
    estimate.stride = stride // 2
    _ask_for_nodes(estimate, fresh)


def _ask_for_nodes(estimate: Estimate, fresh: Masks) -> None:
    """Ask for nodes of the lattice, and where it is complete for pixels that may resemble all around them."""
    stride = estimate.stride
    estimate.want[...] = 0
    estimate.want[::stride, ::stride][fresh] = PREVIEWED if estimate.piloted else node_level(estimate.aim)
    if not estimate.piloted:
        estimate.shown[::stride, ::stride][fresh] = True
        sort(estimate, expected_errors(estimate))
    elif stride == 1:
        estimate.want[(_edges(estimate) | _thin_shadows(estimate)) & (estimate.have < PREVIEWED)] = PREVIEWED


def take_nodes(estimate: Estimate) -> None:
    """Take over what samples found at nodes."""
    if estimate.piloted:
        return
    nodes = estimate.shown & (estimate.have >= SAMPLED)
    for value, halves in zip(estimate.values, estimate.halves.transpose(1, 0, 2, 3), strict=True):
        np.copyto(value, (halves[0] + halves[1]) / 2, where=nodes, casting="same_kind")
    estimate.ways[estimate.shown] = NODE


def lattice_errors(
    estimate: Estimate, stride: int, squares: Floats
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What interpolation errs by beside the nodes of a lattice, less what their noise (H, W) explains."""
    nodes = np.s_[::stride, ::stride]
    labels = estimate.labels[nodes]
    across, along = bends(np.clip(estimate.values[:, *nodes], 0, 1), labels)
    fine = of_labels(estimate.plan.fine, labels)
    explained = (NOISY * np.sqrt(squares[nodes])).astype(np.float32)
    across, along = (np.where(fine, np.inf, np.maximum(found - explained, 0)) for found in (across, along))
    return across, along


def _guess(estimate: Estimate, errors: NDArray[np.float32], stride: int) -> None:
    """Values and squared errors to expect of the finer lattice before anything is known: those of nodes."""
    finer, nodes = np.s_[:: stride // 2, :: stride // 2], np.s_[::stride, ::stride]
    height, width = estimate.have[finer].shape
    between = np.ones((height, width), dtype=bool)
    between[::2, ::2] = False
    squares = MEAN_SQUARE * np.minimum(errors, 1) ** 2
    pairs = [(estimate.doubts[finer], squares)]
    pairs += [(value[finer], value[nodes]) for value in estimate.values]
    for target, coarse in pairs:
        filled = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
        np.copyto(target, filled, where=between)


def variances(estimate: Estimate) -> Floats:
    """Variances of single samples of nodes, mean over channels, (H, W); 0 elsewhere."""
    found = np.zeros(estimate.have.shape)
    if not estimate.piloted:
        nodes = np.flatnonzero(estimate.shown & (estimate.have >= SAMPLED))
        found.ravel()[nodes] = estimate.squares.ravel()[nodes] / (COUNTS[estimate.have.ravel()[nodes]] - 1)
    return found


def noise(estimate: Estimate) -> Floats:
    """Squared errors of nodes, and what is left of them in between, (H, W): none of pilot samples.

    Those of nodes are scaled so that they explain how far the halves are apart.
    """
    found = variances(estimate)
    nodes = np.flatnonzero(found)
    if not nodes.size:
        return found
    squares = found.ravel()[nodes] * COUNTS[estimate.have.ravel()[nodes]] ** -1.5
    apart = np.diff(np.clip(estimate.halves.reshape(2, 3, -1)[:, :, nodes], 0, 1), axis=0)[0]
    found.ravel()[nodes] = squares * (apart**2).mean(axis=0).sum() / (4 * squares.sum())
    interpolate(found, estimate.ways, estimate.coarsest)
    found *= np.where(estimate.ways == NODE, 1.0, LEFT)
    return found


def _marked(estimate: Estimate, places: NDArray[np.int64]) -> Masks:
    marks = np.zeros(estimate.have.shape, dtype=bool)
    marks[places[1], places[0]] = True
    return marks


def _edges(estimate: Estimate) -> Masks:
    """Pixels that edges of flat shapes pass, (H, W)."""
    return _marked(estimate, estimate.plan.edges)


def _thin_shadows(estimate: Estimate) -> Masks:
    """Pixels that thin shadows may pass, (H, W)."""
    columns, rows, shapes = estimate.plan.thin_shadows
    there = estimate.labels[rows, columns] == shapes
    return _marked(estimate, np.stack((columns[there], rows[there])))


def near_thin(estimate: Estimate, reach: int) -> Masks:
    """Pixels so near to shapes that may lie between the nodes of the lattice, (H, W)."""
    near = _marked(estimate, estimate.plan.thin)
    return spread(near, reach) if near.any() else near


def cover_borders(estimate: Estimate) -> None:
    """Ask for many rays where pixels may show more than one thing, for more where these differ more.

    The outermost pixels are among them: no neighbour shows an edge in their outer half. Pilot samples are
    kept: the means that borders are going to show say nothing about the pixels beside them, but the samples
    that they replace do, as of a shadow's edge between the two.
    """
    np.copyto(estimate.pilots, estimate.values, where=estimate.coverage == 0)
    seen, unseen = borders(estimate.labels), _edges(estimate) | near_thin(estimate, 1)
    rim = outline(estimate.have.shape)
    rows, columns = np.nonzero(seen | unseen | rim)
    height, width = estimate.have.shape
    nearby = surroundings(Tile(0, 0, 0, width, height), estimate.around).nearby(rows, columns)
    contrasts = nearby.contrasts()
    typical = contrasts[seen[rows, columns]].mean() if seen.any() else 0.0
    contrasts = np.maximum(contrasts, typical * unseen[rows, columns])
    estimate.contrasts[rows, columns] = contrasts
    estimate.doubts[rows, columns] = nearby.unevenness()
    sizes = cover_sizes(contrasts, BORDERS * estimate.budget)
    estimate.cover[rows, columns] = np.maximum(sizes, (unseen | rim)[rows, columns])
    columns, rows = estimate.plan.lamps
    estimate.cover[rows, columns] = np.maximum(estimate.cover[rows, columns], LIT)


def choose_probes(estimate: Estimate) -> None:
    """Sort pixels into strata by what they show and by their expected error; ask for probes of each."""
    expected = expected_errors(estimate)
    sort(estimate, expected)
    if estimate.piloted:
        _sample_what_pilots_miss(estimate)
    raise_probe_probability(estimate, expected)
    estimate.want[...] = probe_levels(estimate) * probes(estimate)
    np.maximum(estimate.want, node_level(estimate.aim), out=estimate.want, where=estimate.shown)


def expected_errors(estimate: Estimate) -> NDArray[np.float32]:
    """Squared errors to expect of what pixels show without samples of their own, (H, W)."""
    if not estimate.piloted:
        return (noise(estimate) + estimate.doubts).astype(np.float32)
    plan, labels = estimate.plan, estimate.labels
    expected = strata.expected_errors(estimate.pilots)
    if plan.averaged.any():
        _leave_textures_out(estimate, expected)
    covered = estimate.cover > 0
    np.copyto(expected, np.maximum(estimate.doubts, HIDDEN * estimate.contrasts), where=covered)
    np.maximum(expected, estimate.doubts, out=expected, where=of_labels(plan.detailed, labels))
    return expected


def sort(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Sort pixels into strata by what they show and by their expected error (H, W)."""
    plan = estimate.plan
    fine = of_labels(plan.unaveraged | plan.detailed, estimate.labels)
    kinds = np.where(estimate.cover > 0, strata.BORDER, strata.EVEN * (estimate.have > 0))
    kinds[fine & (estimate.have > 0)] = strata.NEEDS_SAMPLING
    estimate.strata[...] = strata.strata_of(expected, kinds)


def raise_probe_probability(estimate: Estimate, expected: Picture) -> None:
    """Make as many pixels probes as the aim needs, where squared errors (H, W) are expected."""
    if not estimate.piloted:
        much = float(expected.sum()) / (MUCH * estimate.budget)
        expected = expected / np.float32(max(much, 1.0))
    wanted = strata.probe_probability(estimate.strata, expected, probe_share(estimate), estimate.budget)
    if not estimate.piloted:
        wanted = np.minimum(CLOSER_PROBES * wanted, 1.0)
    np.maximum(estimate.probe_probability, wanted, out=estimate.probe_probability)


def probe_share(estimate: Estimate) -> float:
    """Least share of all pixels that are probes."""
    return float(np.clip(PROBES_BY_AIM / estimate.aim, FEWEST_PROBES, MOST_PROBES))


def probes(estimate: Estimate) -> Masks:
    """Pixels (H, W) that are probes: whose rank is below the probability of their stratum."""
    ranks = strata.probe_ranks(estimate.plan.seed, estimate.have.shape)
    return ranks < estimate.probe_probability[estimate.strata]


def probe_levels(estimate: Estimate) -> Levels:
    """Levels at which the noise of new probes, (H, W), is no more than the error that is expected there."""
    found = variances(estimate)
    interpolate(found, estimate.ways, estimate.coarsest)
    expected = np.maximum(strata.typical_error(estimate.strata), estimate.aim**2)
    return np.clip(levels_of((found / expected) ** (2 / 3)), PROBED, MOST_PROBED).astype(np.uint8)


def _sample_what_pilots_miss(estimate: Estimate) -> None:
    """Show samples where pilot samples say too little: where thin shadows fall, and where light ends.

    Of what is brighter than white a small share is seen like a large one; of visible lights it is known.
    """
    tinted = of_labels(estimate.plan.tinted, estimate.labels) & ~borders(estimate.labels)
    estimate.controlled |= tinted & (estimate.cover == 0)
    found, bright = _thin_shadows(estimate), (estimate.pilots.max(axis=0) > 1) & ~of_lights(estimate.labels)
    if bright.any():
        found |= (estimate.cover > 0) & spread(bright, 1) & spread(~bright, 1)
    estimate.shown |= found
    estimate.strata[found] = estimate.strata[found] % strata.STEPS + strata.STEPS * strata.SUSPECT


def _leave_textures_out(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Expect of textures, whose mean the pilot sample took, little error: mostly of the light on them.

    Beside another shape the light is no guide.
    """
    colors = np.maximum(estimate.colors, np.float32(DARKEST))
    unlike = of_labels(estimate.plan.averaged, estimate.labels) & ~borders(estimate.labels)
    lit = np.divide(estimate.pilots, colors, dtype=np.float32)
    light = strata.expected_errors(lit)
    light *= (colors**2).mean(axis=0)
    np.maximum(light, BENT * expected, out=light)
    np.copyto(expected, light, where=unlike)
