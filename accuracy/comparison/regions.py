"""Regions where two pictures differ most: adjacent blocks, with the shapes seen there."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.blocks import BLOCK_SIDE, gathered, starts
from accuracy.comparison.pixels import bands
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Masks

DIFFERENCE_SHARE = 0.75
"""Regions consist of the worst blocks that together hold this share of their squared difference."""

MAX_REGIONS = 5
"""Regions reported, at most."""

BACKGROUND = "background"


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle around blocks that touch each other.

    Attributes
    ----------
    x0, y0, x1, y1 : int
        Pixels, half open, rows from the top.
    share : float
        Of the whole squared difference, by its blocks.
    rmse : float
        Linear, over its blocks.
    brightness : float
        Mean of picture - reference, linear: above 0 the picture is too bright.
    shape : int or None
        Index of the shape with most of the squared difference; -1 for the background, None if the shapes are
        not known.
    """

    x0: int
    y0: int
    x1: int
    y1: int
    share: float
    rmse: float
    brightness: float
    shape: int | None


class Rows(Protocol):
    """An array (H, W, 3), or an object that computes its rows on demand."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the whole."""

    def __getitem__(self, rows: slice, /) -> Floats: ...


def worst(
    difference: Rows, errors: Floats, suspects: Masks, shapes: NDArray[Any] | None
) -> tuple[Region, ...]:
    """The worst regions of a difference (H, W, 3), linear, worst first; empty where there is none.

    Parameters
    ----------
    errors : (rows, columns) float64
        Sums of its squares in blocks.
    suspects : (rows, columns) bool
        Blocks that noise does not explain; only these count, or all if there are none.
    shapes : (H, W) int or None
        The layer ``shape`` of the scene.
    """
    total = float(errors.sum())
    if total == 0:
        return ()
    suspicious = errors * suspects if (errors[suspects] > 0).any() else errors
    groups = sorted(_touching(_chosen(suspicious)), key=lambda group: -_sum(errors, group))[:MAX_REGIONS]
    return tuple(_region(difference, shapes, group, total) for group in groups)


def named(shape: int | None, names: Sequence[str]) -> str | None:
    """Describe the shape of a region."""
    if shape is None:
        return None
    return BACKGROUND if shape == MISS else names[shape]


def _chosen(errors: Floats) -> Masks:
    order = np.argsort(-errors, axis=None, kind="stable")
    held = np.cumsum(errors.ravel()[order])
    count = int(np.searchsorted(held, DIFFERENCE_SHARE * held[-1])) + 1
    chosen = np.zeros(errors.size, dtype=bool)
    chosen[order[:count]] = True
    return chosen.reshape(errors.shape)


def _touching(chosen: Masks) -> Iterator[list[tuple[int, int]]]:
    left = {(int(row), int(column)) for row, column in zip(*np.nonzero(chosen), strict=True)}
    while left:
        group = [min(left)]
        left.remove(group[0])
        for row, column in group:
            beside = [(row + down, column + right) for down in (-1, 0, 1) for right in (-1, 0, 1)]
            fresh = [block for block in beside if block in left]
            left.difference_update(fresh)
            group += fresh
        yield group


def _sum(errors: Floats, group: list[tuple[int, int]]) -> float:
    return float(sum(errors[block] for block in group))


def squares_of(difference: Floats) -> Floats:
    """Sums of the squares of a difference (H, W, 3) in blocks, (rows, columns)."""
    return np.asarray(gathered((difference * difference).sum(axis=2)).sum(axis=2))


def _region(
    difference: Rows, shapes: NDArray[Any] | None, group: list[tuple[int, int]], total: float
) -> Region:
    inside = _pixels(difference.shape[:2], group)
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    error, brightness, on = 0.0, 0.0, Counter[int]()
    for first, last in bands(*inside.shape):
        chosen = inside[first:last]
        if chosen.any():
            apart = difference[first:last][chosen]
            squares = (apart * apart).sum(axis=1)
            error, brightness = error + float(squares.sum()), brightness + float(apart.sum())
            if shapes is not None:
                on.update(_sums(shapes[first:last][chosen], squares))
    count = int(np.count_nonzero(inside))
    return Region(
        x0=int(columns[0]),
        y0=int(rows[0]),
        x1=int(columns[-1]) + 1,
        y1=int(rows[-1]) + 1,
        share=min(error / total, 1.0),
        rmse=math.sqrt(error / (3 * count)),
        brightness=brightness / (3 * count),
        shape=None if shapes is None else min(on, key=lambda shape: (-on[shape], shape)),
    )


def _pixels(shape: tuple[int, ...], group: list[tuple[int, int]]) -> Masks:
    """The pixels (H, W) in the blocks of a group."""
    inside = np.zeros(shape, dtype=bool)
    tops, lefts = starts(shape[0]), starts(shape[1])
    for row, column in group:
        inside[tops[row] : tops[row] + BLOCK_SIDE, lefts[column] : lefts[column] + BLOCK_SIDE] = True
    return inside


def _sums(shapes: NDArray[Any], weights: Floats) -> dict[int, Any]:
    """Sums of the weights of each shape; both (N,)."""
    found, indices = np.unique(shapes, return_inverse=True)
    return dict(zip(found.tolist(), np.bincount(indices, weights).tolist(), strict=True))
