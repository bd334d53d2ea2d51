"""Lattices of nodes that grow finer, and values in between where the picture is smooth.

Nodes are pilot samples, or samples through a lens. Between the nodes of a lattice lie three sorts of the next
finer one: between two of a row, between two of a column, and in the middle of four. A second difference
estimates what linear interpolation errs by: where it is small and both sides show the same, no ray is needed.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.rays import Labels
from renderer.math.arrays import Floats

COARSEST = 8
"""Most pixels between the first pilot samples: at 1024 x 1024 pixels that makes `ENOUGH` of them."""

ENOUGH = 16384
"""Pilot samples to begin with. Half as many would cost as much and find less: for few samples, calls are most
of the cost."""

LEFT = 0.55
"""Share of the nodes' squared noise that is left between them: from 4 / 9, interpolated along both axes, to 2
/ 3, along one."""

Picture = NDArray[np.float32]
"""(3, H, W) float32, linear."""

Ways = NDArray[np.uint8]
"""(H, W) uint8, how each pixel gets its value: one of the following."""

NODE, ACROSS, ALONG = 0, 1, 2
"""A value comes from samples of its own; from both sides in its row; from both sides in its column."""

SORTS = (((0, 1), ACROSS), ((1, 0), ALONG), ((1, 1), ACROSS))
"""Row and column, modulo 2, of the sorts of nodes of a finer lattice; the last needs the one before it."""


def stride_for(width: int, height: int) -> int:
    """Pixels between the first pilot samples of a picture, a power of two."""
    return int(2 ** np.clip(np.round(np.log2(width * height / ENOUGH) / 2), 0, np.log2(COARSEST)))


def bends(values: Picture, labels: Labels) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Most that linear interpolation errs by beside nodes, (a, b): along rows and along columns.

    It is an eighth of the second difference, the greatest of the channels. Beside what shows something else
    it is that of the next node; infinite where there is none.

    Parameters
    ----------
    values : (3, a, b) float32
    labels : (a, b) int32
    """
    return _bends(values, labels), _bends(values.transpose(0, 2, 1), labels.T).T


def _bends(values: Picture, labels: Labels) -> NDArray[np.float32]:
    if labels.shape[1] < 3:
        return np.full(labels.shape, np.inf, dtype=np.float32)
    same = labels[:, 1:] == labels[:, :-1]
    second = np.abs(np.diff(values, n=2, axis=2)).max(axis=0) / np.float32(8)
    second[~(same[:, 1:] & same[:, :-1])] = -1
    padded = np.pad(second, ((0, 0), (2, 2)), constant_values=-1)
    own = padded[:, 1:-1]
    known = np.where(own < 0, np.maximum(padded[:, :-2], padded[:, 2:]), own)
    known[known < 0] = np.inf
    return known


def ways_between(
    across: NDArray[np.float32],
    along: NDArray[np.float32],
    labels: Labels,
    shape: tuple[int, ...],
    allowed: float,
) -> Ways:
    """How the nodes of a finer lattice get their values; those of the coarse one are `NODE`.

    Parameters
    ----------
    across, along : (a, b) float32
        What interpolation errs by beside the coarse nodes, along rows and along columns.
    labels : (a, b) int32
    shape : tuple of int
        Of the finer lattice.
    allowed : float
        What it may err by.
    """
    found = np.full(shape, NODE, dtype=np.uint8)
    rows, columns = across.shape
    wide = (np.maximum(across[:, 1:], across[:, :-1]) <= allowed) & (labels[:, 1:] == labels[:, :-1])
    tall = (np.maximum(along[1:], along[:-1]) <= allowed) & (labels[1:] == labels[:-1])
    found[0::2, 1::2][:, : columns - 1] = ACROSS * wide
    found[1::2, 0::2][: rows - 1] = ALONG * tall
    found[1::2, 1::2][: rows - 1, : columns - 1] = ACROSS * (
        wide[1:] & wide[:-1] & tall[:, 1:] & tall[:, :-1]
    )
    return found


def interpolate(values: Floats | Picture, ways: Ways, coarsest: int) -> None:
    """Fill in what lies between the nodes of a picture (C, H, W) or (H, W), up to `coarsest` pixels apart."""
    stride = coarsest
    while stride > 1:
        finer = np.s_[..., :: stride // 2, :: stride // 2]
        interpolate_once(values[finer], ways[finer])
        stride //= 2


def interpolate_once(values: Floats | Picture, ways: Ways) -> None:
    """The same for the nodes of a lattice that are not on the next coarser one."""
    for (row, column), axis in SORTS:
        chosen = ways[row::2, column::2] == axis
        first, second = _sides(values, row, column, axis)
        inside = np.s_[: first.shape[-2], : first.shape[-1]]
        target = values[..., row::2, column::2][(..., *inside)]
        np.copyto(target, (first + second) / 2, where=chosen[inside])


def label_once(labels: Labels, ways: Ways) -> None:
    """Let what is interpolated show what its sides show."""
    for (row, column), axis in SORTS:
        chosen = ways[row::2, column::2] == axis
        first, _ = _sides(labels, row, column, axis)
        inside = np.s_[: first.shape[-2], : first.shape[-1]]
        np.copyto(labels[row::2, column::2][inside], first, where=chosen[inside])


def _sides(values: NDArray[Any], row: int, column: int, axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Values on either side of the nodes of one sort."""
    if axis == ACROSS:
        nodes = values[..., row::2, ::2]
        return nodes[..., :-1], nodes[..., 1:]
    nodes = values[..., ::2, column::2]
    return nodes[..., :-1, :], nodes[..., 1:, :]


def weights(ways: Ways, coarsest: int) -> Floats:
    """How often the squared noise of each node counts in the whole picture, (H, W), at least once."""
    found = np.where(ways == NODE, 1.0, LEFT)
    stride = 2
    while stride <= coarsest:
        finer = np.s_[:: stride // 2, :: stride // 2]
        _pass_on(found[finer], ways[finer])
        stride *= 2
    return found


def _pass_on(found: Floats, ways: Ways) -> None:
    """Let both sides of what is interpolated answer for half of it each."""
    for (row, column), axis in reversed(SORTS):
        passed = found[row::2, column::2] * (ways[row::2, column::2] == axis) / 2
        first, second = _sides(found, row, column, axis)
        passed = passed[: first.shape[0], : first.shape[1]]
        first += passed
        second += passed
