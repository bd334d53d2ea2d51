"""Lattices of nodes that are refined where the picture is not smooth, and interpolation between the nodes.

Nodes are pilot samples, or samples through a lens. The next finer lattice adds three kinds of nodes: between
two of a row, between two of a column, and in the centre of four. Second differences estimate the error of
linear interpolation: where it is small and both sides have the same label, no ray is needed.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.labels import Labels
from renderer.math.arrays import Floats
from schemas.cameras import Camera

MAX_STRIDE = 8
"""Most pixels between the first pilot samples: `FIRST_NODES` of them at 1024 x 1024 pixels."""

LENS_STRIDE_FACTOR = 2
"""Stride of the first lattice through a lens over that of pilot samples: a node costs eight rays or more."""

FIRST_NODES = 16384
"""Pilot samples of the first pass. Half as many would cost as much, as calls dominate, and find less."""

INTERPOLATED_NOISE = 0.55
"""Variance of interpolated values over that of their nodes: from 4 / 9, along both axes, to 2 / 3, along
one."""

Picture = NDArray[np.float32]
"""(3, H, W) float32, linear."""

Axes = NDArray[np.uint8]
"""(H, W) uint8, the axis along which each pixel is interpolated: one of the following."""

NODE, ACROSS, ALONG = 0, 1, 2
"""Not interpolated; from both sides in its row; from both sides in its column."""

NODE_KINDS = (((0, 1), ACROSS), ((1, 0), ALONG), ((1, 1), ACROSS))
"""Row and column, modulo 2, of the kinds of nodes of a finer lattice; the last needs the one before it."""


def first_stride(camera: Camera) -> int:
    """Pixels between the nodes of the first lattice, a power of two, by the size of the whole picture."""
    width, height = camera.picture_size
    steps = np.clip(np.round(np.log2(width * height / FIRST_NODES) / 2), 0, np.log2(MAX_STRIDE))
    return int(2**steps) * (LENS_STRIDE_FACTOR if camera.lens_radius > 0 else 1)


def interpolation_errors(values: Picture, labels: Labels) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Greatest error of linear interpolation beside nodes, (a, b): along rows and along columns.

    An eighth of the second difference, the greatest of the channels. Where that crosses a border, the next
    node's; infinite where that crosses one too.

    Parameters
    ----------
    values : (3, a, b) float32
    labels : (a, b) int32
    """
    return _second_differences(values, labels), _second_differences(values.transpose(0, 2, 1), labels.T).T


def _second_differences(values: Picture, labels: Labels) -> NDArray[np.float32]:
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


def interpolation_axes(
    across: NDArray[np.float32],
    along: NDArray[np.float32],
    labels: Labels,
    shape: tuple[int, ...],
    allowed: float,
) -> Axes:
    """Interpolation axis of each node of a finer lattice, `NODE` for those that need a ray.

    Nodes of the coarse lattice are `NODE`.

    Parameters
    ----------
    across, along : (a, b) float32
        Errors of interpolation beside the coarse nodes, along rows and along columns.
    labels : (a, b) int32
    shape : tuple of int
        Of the finer lattice.
    allowed : float
        Error that is tolerated.
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


def interpolate(values: Floats | Picture, axes: Axes, coarsest: int) -> None:
    """Interpolate between the nodes of a picture (C, H, W) or (H, W), at most `coarsest` pixels apart."""
    stride = coarsest
    while stride > 1:
        finer = np.s_[..., :: stride // 2, :: stride // 2]
        interpolate_once(values[finer], axes[finer])
        stride //= 2


def interpolate_once(values: Floats | Picture, axes: Axes) -> None:
    """Interpolate the nodes of a lattice that are not on the next coarser one."""
    for (row, column), axis in NODE_KINDS:
        chosen = axes[row::2, column::2] == axis
        first, second = _sides(values, row, column, axis)
        inside = np.s_[: first.shape[-2], : first.shape[-1]]
        target = values[..., row::2, column::2][(..., *inside)]
        np.copyto(target, (first + second) / 2, where=chosen[inside])


def interpolate_labels_once(labels: Labels, axes: Axes) -> None:
    """Give interpolated nodes the label of their sides."""
    for (row, column), axis in NODE_KINDS:
        chosen = axes[row::2, column::2] == axis
        first, _ = _sides(labels, row, column, axis)
        inside = np.s_[: first.shape[-2], : first.shape[-1]]
        np.copyto(labels[row::2, column::2][inside], first, where=chosen[inside])


def _sides(values: NDArray[Any], row: int, column: int, axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Values on either side of the nodes of one kind."""
    if axis == ACROSS:
        nodes = values[..., row::2, ::2]
        return nodes[..., :-1], nodes[..., 1:]
    nodes = values[..., ::2, column::2]
    return nodes[..., :-1, :], nodes[..., 1:, :]


def weights(axes: Axes, coarsest: int) -> Floats:
    """Weight of each node's variance in the sum over the whole picture, (H, W), at least 1."""
    found = np.where(axes == NODE, 1.0, INTERPOLATED_NOISE)
    stride = 2
    while stride <= coarsest:
        finer = np.s_[:: stride // 2, :: stride // 2]
        _pass_on(found[finer], axes[finer])
        stride *= 2
    return found


def _pass_on(found: Floats, axes: Axes) -> None:
    """Add half the weight of interpolated nodes to each of their sides."""
    for (row, column), axis in reversed(NODE_KINDS):
        passed = found[row::2, column::2] * (axes[row::2, column::2] == axis) / 2
        first, second = _sides(found, row, column, axis)
        passed = passed[: first.shape[0], : first.shape[1]]
        first += passed
        second += passed
