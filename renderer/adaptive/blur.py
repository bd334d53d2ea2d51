"""Pictures through a lens: samples on a lattice that grows finer, and values in between.

What is out of focus is smooth from pixel to pixel, however sharp it is in itself. So pixels of a coarse
lattice are sampled, in two halves like all pixels that are; where second differences show more than noise,
those of a finer one are sampled too, and everywhere else values are interpolated. Probes, chosen at
random among the interpolated pixels, measure how far these are from the truth.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.between import (
    ACROSS,
    ALONG,
    LEFT,
    NODE,
    bends,
    interpolate,
    interpolate_once,
    ways_between,
)
from renderer.adaptive.early_passes import PROBED, near_thin, probes, raise_probe_probability
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.lattice import stride_for
from renderer.adaptive.levels import COUNTS, SAMPLED, Levels, levels_of
from renderer.math.arrays import Floats, Masks

COARSER = 2
"""Stride of the lattice over that of pilot samples: a node costs eight rays or more."""

NODES = 8, 4 / 255
"""Samples of a new node, and the error for which they are enough; smaller errors need proportionally more."""

MOST = 128
"""Most samples of a new node: they show how many more it needs."""

NOISY = 1.0
"""A second difference of up to this many standard deviations of a node's noise counts as straight."""

PEAK = 4.0
"""Difference of a pixel from both sides, over the error of interpolation that it shows: an eighth of the
second difference, as for a parabola."""

MEAN_SQUARE = 0.5
"""Mean square of the error between nodes, over the square of the largest that bends predict: 8 / 15 for a
parabola."""

CLOSER_PROBES = 2
"""Times as many probes as for pilot samples: less is known beforehand of what lies between noisy nodes."""

MUCH = 4.0
"""When probes are shared out, expected errors count for at most this many times the budget; beyond that,
samples come first."""

HIGHEST_PROBED = 9
"""Highest level of a new probe: 256 samples."""


def first_stride(width: int, height: int) -> int:
    """Pixels between the nodes of the first lattice."""
    return COARSER * stride_for(width, height)


def node_level(error: float) -> int:
    """Level of a new node where an error is aimed at."""
    count, at = NODES
    return int(levels_of(np.clip(count * at / error, count, MOST)))


def sampled_nodes(estimate: Estimate) -> Masks:
    """Pixels that show samples of their own, (H, W)."""
    return estimate.shown & (estimate.have >= SAMPLED)


def update(estimate: Estimate) -> None:
    """Take over what samples found at nodes, and interpolate between them again."""
    nodes = sampled_nodes(estimate)
    for value, halves in zip(estimate.values, estimate.halves.transpose(1, 0, 2, 3), strict=True):
        np.copyto(value, (halves[0] + halves[1]) / 2, where=nodes, casting="same_kind")
    estimate.ways[estimate.shown] = NODE
    interpolate(estimate.values, estimate.ways)


def refine(estimate: Estimate) -> None:
    """Interpolate where the lattice is smooth, and ask for samples at half its stride elsewhere."""
    update(estimate)
    stride = estimate.stride
    nodes, finer = np.s_[::stride, ::stride], np.s_[:: stride // 2, :: stride // 2]
    across, along = _errors(estimate, stride, noise(estimate))
    ways = ways_between(across, along, estimate.ways[finer].shape, estimate.aim)
    ways[near_thin(estimate, stride // 2)[finer]] = NODE
    fresh = ways == NODE
    fresh[::2, ::2] = False
    _guess(estimate, np.maximum(np.maximum(across, along), 0), stride)
    ways[::2, ::2] = estimate.ways[nodes]
    estimate.ways[finer] = ways
    interpolate_once(estimate.values[:, *finer], ways)
    interpolate_once(estimate.doubts[finer], ways)
    estimate.want[...] = 0
    estimate.want[finer][fresh] = node_level(estimate.aim)
    estimate.shown[finer][fresh] = True
    estimate.stride = stride // 2
    _sort(estimate)


def _guess(estimate: Estimate, errors: NDArray[np.float32], stride: int) -> None:
    """Values and squared errors to expect of the finer lattice before anything is known: those of nodes."""
    finer = np.s_[:: stride // 2, :: stride // 2]
    nodes = np.s_[::stride, ::stride]
    height, width = estimate.have[finer].shape
    between = np.ones((height, width), dtype=bool)
    between[::2, ::2] = False
    squares = np.float32(MEAN_SQUARE) * errors * errors
    pairs = [(estimate.doubts[finer], squares)]
    pairs += [(value[finer], value[nodes]) for value in estimate.values]
    for target, coarse in pairs:
        filled = coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]
        np.copyto(target, filled, where=between)


def _errors(
    estimate: Estimate, stride: int, squares: Floats
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """What interpolation errs by beside the nodes of a lattice, less what their noise (H, W) explains."""
    nodes = np.s_[::stride, ::stride]
    explained = (NOISY * np.sqrt(squares[nodes])).astype(np.float32)
    across, along = bends(np.clip(estimate.values[:, *nodes], 0, 1))
    return across - explained, along - explained


def _variances(estimate: Estimate) -> Floats:
    """Variances of single samples of nodes, mean over channels, (H, W); 0 elsewhere."""
    found = np.zeros(estimate.have.shape)
    nodes = np.flatnonzero(sampled_nodes(estimate))
    found.ravel()[nodes] = estimate.squares.ravel()[nodes] / (COUNTS[estimate.have.ravel()[nodes]] - 1)
    return found


def noise(estimate: Estimate) -> Floats:
    """Squared errors of nodes, and what is left of them in between, (H, W).

    Those of nodes are scaled so that they explain how far the halves are apart.
    """
    found = _variances(estimate)
    nodes = np.flatnonzero(found)
    squares = found.ravel()[nodes] * COUNTS[estimate.have.ravel()[nodes]] ** -1.5
    if nodes.size:
        apart = np.diff(np.clip(estimate.halves.reshape(2, 3, -1)[:, :, nodes], 0, 1), axis=0)[0]
        squares *= (apart**2).mean(axis=0).sum() / (4 * squares.sum())
    found.ravel()[nodes] = squares
    interpolate(found, estimate.ways)
    found *= np.where(estimate.ways == NODE, 1.0, LEFT)
    return found


def missing_nodes(estimate: Estimate, allowed: float) -> Masks:
    """Interpolated pixels beside which the picture bends by more than is allowed, (H, W)."""
    squares = noise(estimate)
    found = np.zeros(estimate.have.shape, dtype=bool)
    stride = first_stride(estimate.plan.width, estimate.plan.height)
    while stride > 1:
        finer = np.s_[:: stride // 2, :: stride // 2]
        across, along = _errors(estimate, stride, squares)
        ways = ways_between(across, along, found[finer].shape, allowed)
        missing = (ways == NODE) & (estimate.ways[finer] != NODE)
        missing[::2, ::2] = False
        found[finer] |= missing
        stride //= 2
    found |= _lonely(estimate, squares, allowed)
    return found & ~estimate.shown


def _lonely(estimate: Estimate, squares: Floats, allowed: float) -> Masks:
    """Pixels brighter or darker than both samples beside them on the axis that they do not come from, (H, W).

    Nodes of both sides may miss a line as thin as a pixel that ends or runs askew between them.
    """
    values = np.clip(estimate.values, 0, 1)
    noises = NOISY * np.sqrt(squares)
    found = np.zeros(squares.shape, dtype=bool)
    for axis, picture, noisy, ways, mask in (
        (ALONG, values, noises, estimate.ways, found),
        (ACROSS, values.transpose(0, 2, 1), noises.T, estimate.ways.T, found.T),
    ):
        before, after = (picture[:, :, 1:-1] - side for side in (picture[:, :, :-2], picture[:, :, 2:]))
        least = np.where(before * after > 0, np.minimum(np.abs(before), np.abs(after)), 0).max(axis=0)
        least -= np.maximum(noisy[:, :-2], noisy[:, 2:])
        sampled = (ways[:, :-2] == NODE) & (ways[:, 2:] == NODE)
        mask[:, 1:-1] |= (ways[:, 1:-1] == axis) & sampled & (least > PEAK * allowed)
    return found


def _sort(estimate: Estimate) -> NDArray[np.float32]:
    """Sort the pixels by the squared errors that are expected of them, (H, W)."""
    expected = (noise(estimate) + estimate.doubts).astype(np.float32)
    nothing = np.zeros(estimate.have.shape, dtype=np.uint8)
    estimate.strata[...] = strata.strata_of(expected, nothing, nothing.astype(bool))
    return expected


def choose_probes(estimate: Estimate) -> None:
    """Sort the pixels, and ask for probes of each sort."""
    update(estimate)
    expected = _sort(estimate)
    much = float(expected.sum()) / (MUCH * estimate.budget)
    raise_probe_probability(estimate, expected / np.float32(max(much, 1.0)))
    np.minimum(CLOSER_PROBES * estimate.probe_probability, 1.0, out=estimate.probe_probability)
    estimate.want[...] = probe_levels(estimate) * (probes(estimate) & ~estimate.shown)


def probe_levels(estimate: Estimate) -> Levels:
    """Levels at which the noise of new probes, (H, W), is no more than the error that is expected there."""
    variances = _variances(estimate)
    interpolate(variances, estimate.ways)
    expected = np.maximum(strata.typical_error(estimate.strata), estimate.aim**2)
    levels = levels_of((variances / expected) ** (2 / 3))
    return np.clip(levels, PROBED, HIGHEST_PROBED).astype(np.uint8)
