"""First looks on lattices that grow finer, and values in between where the picture is smooth."""

import numpy as np
from numpy.typing import NDArray

from renderer.arrays import Masks

COARSEST = 8
"""Pixels between the first looks to begin with."""

Picture = NDArray[np.float32]
"""(3, H, W) float32."""
Labels = NDArray[np.int32]
"""(H, W) int32: what the first look at a pixel met."""


def smooth_cells(values: Picture, labels: Labels, rough: Masks, allowed: float) -> Masks:
    """Cells of a lattice, (a - 1, b - 1), between whose four corners the picture may be interpolated.

    The corners show one shape with nothing fine on it, and the second differences along and across say that
    interpolation errs by no more than `allowed`. At the border of a shape they are taken on its own side.

    Parameters
    ----------
    values : (3, a, b) float32
    labels : (a, b) int32
    rough : (a, b) bool
        Nodes that show something finer than the lattice can tell.
    allowed : float
        Least error of a cell to count, linear radiance.
    """
    same = labels[:, 1:] == labels[:, :-1]
    across = _curvature(values, same)
    below = labels[1:] == labels[:-1]
    along = _curvature(values.transpose(0, 2, 1), below.T).T
    error = (_of_cells(across, "max") + _of_cells(along, "max")) / 8
    calm = _of_cells(~rough, "and") & (same[1:] & same[:-1] & below[:, 1:])
    return calm & (error <= allowed)


def _curvature(values: Picture, same: Masks) -> NDArray[np.float32]:
    """Largest second difference of the channels at each node (a, b), along the last axis.

    The one of the next node where a neighbour shows something else, infinite where that does not help.
    """
    steps = np.diff(values, axis=2)
    second = np.abs(np.diff(steps, axis=2)).max(axis=0)
    second[~(same[:, 1:] & same[:, :-1])] = -1.0
    padded = np.pad(second, ((0, 0), (2, 2)), constant_values=-1.0)
    own, before, after = padded[:, 1:-1], padded[:, :-2], padded[:, 2:]
    known = np.maximum(own, np.maximum(before, after) * (own < 0))
    known[known < 0] = np.inf
    return known


def _of_cells(nodes: NDArray[np.generic], how: str) -> NDArray[np.generic]:
    join = np.maximum if how == "max" else np.logical_and
    return join(join(nodes[1:, 1:], nodes[1:, :-1]), join(nodes[:-1, 1:], nodes[:-1, :-1]))
