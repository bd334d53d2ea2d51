"""Regions where two pictures differ most: adjacent blocks, with the shapes seen there."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.blocks import SIDE, gathered, starts
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Integers, Masks

SHARE = 0.75
"""Regions consist of the worst blocks that together hold this share of their squared difference."""

MOST = 5
"""Regions reported, at most."""

GROUND = "background"


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
        The shape that most of the squared difference lies on, by its index; -1 for the background, None where
        the shapes are not known.
    """

    x0: int
    y0: int
    x1: int
    y1: int
    share: float
    rmse: float
    brightness: float
    shape: int | None


def worst(difference: Floats, suspects: Masks, shapes: NDArray[Any] | None) -> tuple[Region, ...]:
    """The worst regions of a difference (H, W, 3), linear, worst first; empty where there is none.

    Parameters
    ----------
    suspects : (rows, columns) bool
        Blocks that noise does not explain; only these count, or all where there is none.
    shapes : (H, W) int or None
        The layer ``shape`` of the scene.
    """
    squares = (difference * difference).sum(axis=2)
    errors = gathered(squares).sum(axis=2)
    total = float(errors.sum())
    if total == 0:
        return ()
    suspicious = errors * suspects if (errors[suspects] > 0).any() else errors
    groups = sorted(_touching(_chosen(suspicious)), key=lambda group: -_sum(errors, group))[:MOST]
    return tuple(_region(difference, squares, shapes, group, total) for group in groups)


def named(shape: int | None, names: Sequence[str]) -> str | None:
    """A shape of a region in words."""
    if shape is None:
        return None
    return GROUND if shape == MISS else names[shape]


def _chosen(errors: Floats) -> Masks:
    order = np.argsort(-errors, axis=None, kind="stable")
    held = np.cumsum(errors.ravel()[order])
    count = int(np.searchsorted(held, SHARE * held[-1])) + 1
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


def _region(
    difference: Floats,
    squares: Floats,
    shapes: NDArray[Any] | None,
    group: list[tuple[int, int]],
    total: float,
) -> Region:
    rows, columns = _pixels(squares.shape, group)
    own = squares[rows, columns]
    y0, x0 = int(rows.min()), int(columns.min())
    error = float(own.sum())
    return Region(
        x0=x0,
        y0=y0,
        x1=int(columns.max()) + 1,
        y1=int(rows.max()) + 1,
        share=min(error / total, 1.0),
        rmse=math.sqrt(error / (3 * own.size)),
        brightness=float(difference[rows, columns].mean()),
        shape=None if shapes is None else _most(shapes[rows, columns], own),
    )


def _pixels(shape: tuple[int, ...], group: list[tuple[int, int]]) -> tuple[Integers, Integers]:
    """Rows and columns of all pixels in the blocks of a group, each once."""
    inside = np.zeros(shape, dtype=bool)
    tops, lefts = starts(shape[0]), starts(shape[1])
    for row, column in group:
        inside[tops[row] : tops[row] + SIDE, lefts[column] : lefts[column] + SIDE] = True
    rows, columns = np.nonzero(inside)
    return rows, columns


def _most(shapes: NDArray[Any], weights: Floats) -> int:
    found, places = np.unique(shapes, return_inverse=True)
    return int(found[np.argmax(np.bincount(places, weights))])
