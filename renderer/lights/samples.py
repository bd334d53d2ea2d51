"""Light points, L per point of the scene, and their functions that shading needs.

A light point is q = centre + u first + v second with u, v in (-1/2, 1/2), so every dot product with
q - p is affine in u and v. Pair arrays have shape (L, n): one row a light point, so that the innermost
loop of every operation is as long as the block.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Pairs
from renderer.workspace import Workspace

Terms = tuple[Floats, Floats, Floats]
"""Affine functions on a light, per point: value at the centre, and slopes along u and v, (n,) each."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Position of a light relative to n points, in the light's axes, scaled per point.

    Attributes
    ----------
    across, along, away : (n,) float64
        The point minus the light's centre, in light axes: first edge, in-plane perpendicular, normal.
    first, second_across, second_along : (n,) float64
        Edge lengths in the same scale: first edge, and both components of the second.
    """

    across: Floats
    along: Floats
    away: Floats
    first: Floats
    second_across: Floats
    second_along: Floats


class LightPoints(ABC):
    """L light points for each of n points."""

    count: int

    @abstractmethod
    def affine(self, terms: Terms, out: Pairs, workspace: Workspace) -> Pairs:
        """An affine function for all pairs, into `out` (L, n)."""

    @abstractmethod
    def squared_distances(self, frame: Frame, out: Pairs, workspace: Workspace) -> Pairs:
        """Squares of the distances in the scale of `frame`, into `out` (L, n).

        They are sums of squares, so nothing cancels.
        """

    @abstractmethod
    def places(self, index: Integers) -> tuple[Floats, Floats]:
        """Coordinates u and v of the light points of some of the n points, (L, m) or (L, 1) each."""

    @abstractmethod
    def chosen(self, index: Integers) -> "LightPoints":
        """The same for some of the n points."""


class Grid(LightPoints):
    """The same grid for all points. A function of row plus a function of column: one addition a pair."""

    def __init__(self, u: Floats, v: Floats) -> None:
        self.u, self.v = u[:, None], v[:, None]
        self.count = u.size * v.size

    def affine(self, terms: Terms, out: Pairs, workspace: Workspace) -> Pairs:
        """Sum of a function of row and a function of column."""
        del workspace
        constant, by_u, by_v = terms
        return _sum(constant + self.u * by_u, self.v * by_v, out)

    def squared_distances(self, frame: Frame, out: Pairs, workspace: Workspace) -> Pairs:
        """With perpendicular edges, again a sum over row and column."""
        del workspace
        across = self.u * frame.first - frame.across
        along = self.v * frame.second_along - frame.along
        return _sum(across * across, along * along + frame.away * frame.away, out)

    def places(self, index: Integers) -> tuple[Floats, Floats]:
        """Row by row of the grid, one column for all."""
        del index
        return self.u.repeat(self.v.size, axis=0), np.tile(self.v, (self.u.size, 1))

    def chosen(self, index: Integers) -> "Grid":
        """The grid itself: it is the same for all points."""
        del index
        return self


def _sum(by_row: Floats, by_column: Floats, out: Pairs) -> Pairs:
    rows, columns, n = by_row.shape[0], by_column.shape[0], by_row.shape[1]
    a, b = by_row.astype(out.dtype), by_column.astype(out.dtype)
    np.add(a[:, None], b[None], out=out.reshape(rows, columns, n))
    return out


class Scatter(LightPoints):
    """Points that differ from place to place, u and v of shape (L, n), or one set for all, (L, 1)."""

    def __init__(self, u: Pairs, v: Pairs) -> None:
        self.u, self.v = u, v
        self.count = u.shape[0]

    def affine(self, terms: Terms, out: Pairs, workspace: Workspace) -> Pairs:
        """Two products and two sums a pair."""
        constant, by_u, by_v = (term.astype(out.dtype) for term in terms)
        spare = workspace.like("affine", out)
        np.multiply(self.u, by_u, out=out)
        np.multiply(self.v, by_v, out=spare)
        np.add(out, spare, out=out)
        return np.add(out, constant, out=out)

    def squared_distances(self, frame: Frame, out: Pairs, workspace: Workspace) -> Pairs:
        """The edges may have any angle."""
        other = workspace.like("distance", out)
        self.affine((-frame.across, frame.first, frame.second_across), out, workspace)
        np.multiply(out, out, out=out)
        self.affine((-frame.along, np.zeros_like(frame.along), frame.second_along), other, workspace)
        np.multiply(other, other, out=other)
        np.add(out, other, out=out)
        return np.add(out, (frame.away * frame.away).astype(out.dtype), out=out)

    def places(self, index: Integers) -> tuple[Floats, Floats]:
        """The columns of some points, in float64."""
        some = self.chosen(index)
        return some.u.astype(np.float64), some.v.astype(np.float64)

    def chosen(self, index: Integers) -> "Scatter":
        """The columns of some points."""
        if self.u.shape[1] == 1:
            return self
        return Scatter(np.take(self.u, index, axis=1), np.take(self.v, index, axis=1))
