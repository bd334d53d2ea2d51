"""What the first passes of an adaptive picture ask for: looks, closer looks, borders and probes."""

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.estimate import STRIDE, Estimate
from renderer.adaptive.labels import of_labels
from renderer.adaptive.lattice import Picture, cells_of, fill
from renderer.adaptive.levels import COVERED, LOOKED, SAMPLED
from renderer.adaptive.neighbours import highest, outline, spread
from renderer.arrays import Masks

CALM = 2
"""Times the wished error that interpolation may err by. It mostly errs by far less: the least smooth place
decides."""

PROBED = SAMPLED + 1
"""Level of a new probe: 8 samples."""

WIDE = 2
"""How far around, in pixels, looks tell of what is finer than pixels: the one at it may have missed it."""

BENT = np.float32(2.0**-10)
"""Share of what a look-up at a point would err by that is left: means are taken over parallelograms, and a
pixel far away is not quite one."""

DARKEST = 2.0**-10
"""Darker textures than this are taken to be as bright, so that the light on them can be told."""


def look_closer(estimate: Estimate) -> None:
    """Interpolate where the lattice is smooth, and ask for looks at half its stride elsewhere."""
    stride = int(estimate.counters[STRIDE])
    nodes = np.s_[::stride, ::stride]
    cells = cells_of(
        estimate.values[:, *nodes],
        estimate.labels[nodes],
        (fine(estimate) | _near(estimate, stride))[nodes],
        CALM * estimate.aim,
    )
    half = stride // 2
    finer = np.s_[::half, ::half]
    estimate.want[...] = 0
    estimate.want[finer][fill(estimate.values[:, *finer], estimate.labels[finer], cells)] = LOOKED
    estimate.counters[STRIDE] = half
    if half == 1:
        estimate.want[_edges(estimate) & (estimate.have < LOOKED)] = LOOKED


def fine(estimate: Estimate) -> Masks:
    """Pixels that show something that may be finer than the lattice, (H, W)."""
    return of_labels(estimate.plan.rough | estimate.plan.textured, estimate.labels)


def _edges(estimate: Estimate) -> Masks:
    """Pixels that edges of flat shapes pass, (H, W)."""
    passed = np.zeros(estimate.have.shape, dtype=bool)
    passed[estimate.plan.edges[1], estimate.plan.edges[0]] = True
    return passed


def _near(estimate: Estimate, reach: int) -> Masks:
    """Pixels so near to shapes that may lie between the nodes of the lattice, (H, W)."""
    near = np.zeros(estimate.have.shape, dtype=bool)
    near[estimate.plan.thin[1], estimate.plan.thin[0]] = True
    return spread(near, reach) if near.any() else near


def cover_borders(estimate: Estimate) -> None:
    """Ask for many rays where pixels may show more than one thing.

    The outermost pixels are among them: no neighbour tells of an edge in their outer half.
    """
    found = strata.borders(estimate.labels) | outline(estimate.have.shape) | _edges(estimate)
    found |= _near(estimate, 1)
    estimate.want[...] = COVERED * found


def choose_probes(estimate: Estimate) -> None:
    """Sort the pixels by what they show and what is expected of their looks; ask for probes of each sort."""
    covered = estimate.have == COVERED
    expected = strata.expected_errors(estimate.values, covered)
    blurred = np.maximum(estimate.doubts, expected * np.float32(estimate.plan.coverage**-1.5))
    if estimate.plan.averaged.any():
        _leave_textures_out(estimate, expected)
    np.copyto(expected, blurred, where=covered)
    detailed = of_labels(estimate.plan.detailed, estimate.labels)
    np.maximum(expected, estimate.doubts, out=expected, where=detailed)
    finer = estimate.plan.rough | estimate.plan.textured & ~estimate.plan.averaged
    rough = of_labels(finer, estimate.labels)
    np.copyto(expected, highest(expected, WIDE), where=rough)
    estimate.strata[...] = strata.strata_of(expected, estimate.have, rough | detailed)
    _sample_bright_borders(estimate)
    raise_chances(estimate, expected)
    estimate.want[...] = PROBED * (probes(estimate) | estimate.shown)


def raise_chances(estimate: Estimate, expected: Picture) -> None:
    """Make as many pixels probes as the aim needs, where squared errors (H, W) are expected."""
    wanted = strata.chances(estimate.strata, expected, probe_share(estimate), estimate.budget)
    np.maximum(estimate.chances, wanted, out=estimate.chances)


def probe_share(estimate: Estimate) -> float:
    """Least share of all pixels that are probes."""
    return float(np.clip(2.0**-15 / estimate.aim, 2.0**-8, 2.0**-2))


def _sample_bright_borders(estimate: Estimate) -> None:
    """Show samples where something brighter than white ends: a small share of it is seen like a large one."""
    bright = estimate.values.max(axis=0) > 1
    if bright.any():
        found = (estimate.have == COVERED) & spread(bright, 1) & spread(~bright, 1)
        estimate.shown |= found
        estimate.strata[found] = estimate.strata[found] % strata.STEPS + strata.STEPS * strata.SUSPECT


def _leave_textures_out(estimate: Estimate, expected: NDArray[np.float32]) -> None:
    """Expect of textures, whose mean the first look took, little error: mostly of the light on them.

    Beside another shape the light is no guide.
    """
    colors = np.maximum(estimate.colors, np.float32(DARKEST))
    unlike = of_labels(estimate.plan.averaged, estimate.labels) & ~strata.borders(estimate.labels)
    light = strata.expected_errors(np.divide(estimate.values, colors, dtype=np.float32))
    light *= (colors**2).mean(axis=0)
    np.maximum(light, BENT * expected, out=light)
    np.copyto(expected, light, where=unlike)


def probes(estimate: Estimate) -> Masks:
    """Pixels (H, W) that the lot makes probes."""
    return strata.lots(estimate.plan.seed, estimate.have.shape) < estimate.chances[estimate.strata]
