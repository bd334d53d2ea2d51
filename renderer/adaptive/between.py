"""What lies between the nodes of a lattice: along which axis it is interpolated, and with what noise.

The nodes of the next finer lattice are of three sorts: between two nodes of a row, between two of a column,
and in the middle of four. The first two are interpolated along their row or their column, the last along
either. So an edge that runs along a row needs samples across it alone.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.lattice import Picture
from renderer.math.arrays import Floats

Ways = NDArray[np.uint8]
"""(H, W) uint8, how each pixel gets its value: one of the following."""

NODE, ACROSS, ALONG = 0, 1, 2
"""A value comes from samples of its own; from both sides in its row; from both sides in its column."""

WIDEST = 64
"""Stride at least as coarse as any picture's first lattice; a larger one would cost nothing."""

LEFT = 0.55
"""Share of the nodes' squared noise that is left between them: from 4 / 9, interpolated along both axes, to 2
/ 3, along one."""

_BESIDE, _BELOW, _MIDDLE = (0, 1), (1, 0), (1, 1)
"""Row and column, modulo 2, of the three sorts of nodes of a finer lattice."""

_FINER = ((_BESIDE, ACROSS), (_BELOW, ALONG), (_MIDDLE, ACROSS), (_MIDDLE, ALONG))
"""In the order in which they can be interpolated: the last two sorts may need the first."""


def bends(values: Picture) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Most that linear interpolation errs by beside nodes (3, a, b): along rows and along columns, (a, b).

    It is an eighth of the second difference, the greatest of the channels; at a rim that of the next node.
    """
    return _bends(values), _bends(values.transpose(0, 2, 1)).T


def _bends(values: Picture) -> NDArray[np.float32]:
    second = np.abs(np.diff(values, n=2, axis=2)).max(axis=0)
    if not second.size:
        return np.zeros(values.shape[1:], dtype=np.float32)
    return (np.pad(second, ((0, 0), (1, 1)), mode="edge") / 8).astype(np.float32)


def ways_between(
    across: NDArray[np.float32], along: NDArray[np.float32], shape: tuple[int, ...], allowed: float
) -> Ways:
    """How the nodes of a finer lattice get their values; those of the coarse one are `NODE`.

    Parameters
    ----------
    across, along : (a, b) float32
        What interpolation errs by beside the coarse nodes, along rows and along columns.
    shape : tuple of int
        Of the finer lattice.
    allowed : float
        What it may err by.
    """
    found = np.full(shape, NODE, dtype=np.uint8)
    rows, columns = across.shape
    wide, tall = np.maximum(across[:, 1:], across[:, :-1]), np.maximum(along[1:], along[:-1])
    found[0::2, 1::2][:, : columns - 1] = ACROSS * (wide <= allowed)
    found[1::2, 0::2][: rows - 1] = ALONG * (tall <= allowed)
    wide, tall = np.maximum(wide[1:], wide[:-1]), np.maximum(tall[:, 1:], tall[:, :-1])
    middle = np.where(wide <= tall, ACROSS, ALONG) * (np.minimum(wide, tall) <= allowed)
    found[1::2, 1::2][: rows - 1, : columns - 1] = middle
    return found


def interpolate(values: Floats | Picture, ways: Ways) -> None:
    """Fill in what lies between the nodes of a picture (C, H, W) or (H, W) with the mean of either side."""
    stride = WIDEST
    while stride > 1:
        finer = np.s_[..., :: stride // 2, :: stride // 2]
        interpolate_once(values[finer], ways[finer])
        stride //= 2


def interpolate_once(values: Floats | Picture, ways: Ways) -> None:
    """The same for the nodes of a lattice that are not on the next coarser one."""
    for (row, column), axis in _FINER:
        chosen = ways[row::2, column::2] == axis
        if chosen.any():
            first, second = _sides(values, row, column, axis)
            inside = np.s_[: first.shape[-2], : first.shape[-1]]
            target = values[..., row::2, column::2][(..., *inside)]
            np.copyto(target, (first + second) / 2, where=chosen[inside])


def _sides(values: NDArray[Any], row: int, column: int, axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Values on either side of the nodes of one sort."""
    if axis == ACROSS:
        nodes = values[..., row::2, ::2]
        return nodes[..., :-1], nodes[..., 1:]
    nodes = values[..., ::2, column::2]
    return nodes[..., :-1, :], nodes[..., 1:, :]


def weights(ways: Ways) -> Floats:
    """How often the squared noise of each node counts in the whole picture, (H, W), at least once."""
    found = np.where(ways == NODE, 1.0, LEFT)
    stride = 2
    while stride <= WIDEST:
        finer = np.s_[:: stride // 2, :: stride // 2]
        _pass_on(found[finer], ways[finer])
        stride *= 2
    return found


def _pass_on(found: Floats, ways: Ways) -> None:
    """Let both sides of what is interpolated answer for half of it each."""
    for (row, column), axis in reversed(_FINER):
        passed = found[row::2, column::2] * (ways[row::2, column::2] == axis) / 2
        first, second = _sides(found, row, column, axis)
        passed = passed[: first.shape[0], : first.shape[1]]
        first += passed
        second += passed
