"""Pilot samples on lattices that grow finer, and values in between where the picture is smooth.

Where four neighbouring nodes of the lattice show the same shape, and the second differences around them
are small, the nodes of the finer lattice between them are interpolated and take no ray.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import Labels
from renderer.math.arrays import Masks

COARSEST = 8
"""Most pixels between the first pilot samples: at 1024 x 1024 pixels that makes `ENOUGH` of them."""

ENOUGH = 16384
"""Pilot samples to begin with. Half as many would cost as much and find less: for few samples, calls are most
of the cost."""

Picture = NDArray[np.float32]
"""(3, H, W) float32, linear."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """What lies between the nodes of a lattice of (a, b) nodes: where it may be interpolated.

    Attributes
    ----------
    middles : (a - 1, b - 1) bool
        Cells that are smooth.
    across : (a, b - 1) bool
        Edges between neighbours in a row, both of whose cells are smooth; at the border of the picture, one.
    along : (a - 1, b) bool
        The same for neighbours in a column.
    """

    middles: Masks
    across: Masks
    along: Masks


def stride_for(width: int, height: int) -> int:
    """Pixels between the first pilot samples of a picture, a power of two."""
    return int(2 ** np.clip(np.round(np.log2(width * height / ENOUGH) / 2), 0, np.log2(COARSEST)))


def cells_of(values: Picture, labels: Labels, needs_sampling: Masks, allowed: float) -> Cells:
    """Where a lattice may be interpolated.

    Parameters
    ----------
    values : (3, a, b) float32
    labels : (a, b) int32
    needs_sampling : (a, b) bool
        Nodes that show something finer than the lattice.
    allowed : float
        What interpolation may err by, as second differences estimate it; linear radiance.
    """
    in_row, in_column = labels[:, 1:] == labels[:, :-1], labels[1:] == labels[:-1]
    across, along = _bends(values, in_row), _bends(values.transpose(0, 2, 1), in_column.T).T
    same = in_row[1:] & in_row[:-1] & in_column[:, 1:]
    error = (_greatest(across) + _greatest(along)) / 8
    middles = same & ~_any(needs_sampling) & (error <= allowed)
    ringed = np.pad(middles, 1, constant_values=bool(middles.size))
    return Cells(
        middles=middles,
        across=in_row & ringed[:-1, 1:-1] & ringed[1:, 1:-1],
        along=in_column & ringed[1:-1, :-1] & ringed[1:-1, 1:],
    )


def _bends(values: Picture, same: Masks) -> NDArray[np.float32]:
    """Greatest second difference of the channels along the last axis at each node (a, b).

    Where a neighbour shows something else, that of the next node on the same side; infinite where there is
    none.
    """
    second = np.abs(np.diff(values, n=2, axis=2)).max(axis=0)
    second[~(same[:, 1:] & same[:, :-1])] = -1.0
    padded = np.pad(second, ((0, 0), (2, 2)), constant_values=-1.0)
    own = padded[:, 1:-1]
    known = np.maximum(own, np.maximum(padded[:, :-2], padded[:, 2:]) * (own < 0))
    known[known < 0] = np.inf
    return known


def _greatest(nodes: NDArray[np.float32]) -> NDArray[np.float32]:
    pairs = np.maximum(nodes[1:], nodes[:-1])
    return np.maximum(pairs[:, 1:], pairs[:, :-1])


def _any(nodes: Masks) -> Masks:
    pairs = nodes[1:] | nodes[:-1]
    return pairs[:, 1:] | pairs[:, :-1]


def fill(values: Picture, labels: Labels, cells: Cells) -> Masks:
    """Interpolate the nodes of the finer lattice in place; gives those that need a pilot sample, (a', b').

    Parameters
    ----------
    values, labels
        Views of the finer lattice (3, a', b') and (a', b'), whose every other node is known.
    cells : Cells
        Of the coarser lattice.
    """
    unknown = np.ones(labels.shape, dtype=bool)
    unknown[::2, ::2] = False
    coarse, marks = values[:, ::2, ::2], labels[::2, ::2]
    across, along = (coarse[:, :, 1:] + coarse[:, :, :-1]) / 2, (coarse[:, 1:] + coarse[:, :-1]) / 2
    middle = (across[:, 1:] + across[:, :-1]) / 2
    for place, chosen, found, mark in (
        (np.s_[0::2, 1::2], cells.across, across, marks[:, 1:]),
        (np.s_[1::2, 0::2], cells.along, along, marks[1:]),
        (np.s_[1::2, 1::2], cells.middles, middle, marks[1:, 1:]),
    ):
        inside = np.s_[: chosen.shape[0], : chosen.shape[1]]
        np.copyto(values[(slice(None), *place)][(slice(None), *inside)], found, where=chosen)
        np.copyto(labels[place][inside], mark, where=chosen)
        unknown[place][inside] = ~chosen
    return unknown
