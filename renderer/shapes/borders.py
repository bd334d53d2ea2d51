"""Borders that displaced shapes have in common: cut and moved alike, so that no crack opens between them.

Only shapes of one height map and one height are joined, and only where both end: on edges that one triangle
of each has to itself, with corners that agree bit for bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, unit
from renderer.shapes.meshes import Surface, place_numbers

EDGES = ((0, 1), (1, 2), (2, 0))


@dataclass(slots=True, eq=False)
class Lift:
    """How the places of a fine mesh are moved.

    Attributes
    ----------
    places : (3, P) float64
        Each once.
    owner : (V,) int64
        Place of each vertex.
    normals : (3, P) float64
        Unit.
    heights : (P,) float64
        Scene units.
    border : (P,) bool
        Places where the shape ends.
    """

    places: Floats
    owner: Integers
    normals: Floats
    heights: Floats
    border: Masks

    def moved(self) -> Floats:
        """Where the vertices come to lie, (3, V)."""
        return (self.places + self.normals * self.heights)[:, self.owner]


def open_edges(surface: Surface) -> Masks:
    """Edges (3, T) from corner to corner of each triangle that it has to itself."""
    numbers = place_numbers(surface.vertices)[surface.triangles]
    _, which, count = np.unique(_named(numbers, numbers.max() + 1), return_inverse=True, return_counts=True)
    return np.asarray(count[which.reshape(-1)].reshape(3, -1) == 1)


def _named(numbers: Integers, base: int) -> Integers:
    """One number for each edge (3 * T,) of triangles (3, T), whichever way round."""
    pairs = [numbers[list(edge)] for edge in EDGES]
    return np.concatenate([pair.min(axis=0) * base + pair.max(axis=0) for pair in pairs])


def neighbours(surfaces: Sequence[Surface]) -> Integers:
    """The same number (N,) for surfaces that have open edges in common, or neighbours that do."""
    if len(surfaces) < 2:
        return np.arange(len(surfaces))
    sizes = [surface.vertices.shape[1] for surface in surfaces]
    numbers = np.split(
        place_numbers(np.hstack([surface.vertices for surface in surfaces])), np.cumsum(sizes)[:-1]
    )
    base = sum(sizes)
    names = [
        _named(number[surface.triangles], base)[open_edges(surface).reshape(-1)]
        for number, surface in zip(numbers, surfaces, strict=True)
    ]
    groups = np.arange(len(surfaces))
    owners = groups.repeat([name.size for name in names])
    order = np.argsort(np.concatenate(names), kind="stable")
    named, owners = np.concatenate(names)[order], owners[order]
    for here in np.flatnonzero(named[1:] == named[:-1]):
        a, b = groups[owners[here]], groups[owners[here + 1]]
        groups[groups == b] = a
    return groups


def join(lifts: Sequence[Lift]) -> None:
    """Give border places that several shapes have one normal and one height: the means of theirs."""
    chosen = [np.flatnonzero(lift.border) for lift in lifts]
    parts = list(zip(lifts, chosen, strict=True))
    numbers = place_numbers(np.hstack([lift.places[:, some] for lift, some in parts]))
    share = np.bincount(numbers)
    heights = np.bincount(numbers, np.concatenate([lift.heights[some] for lift, some in parts])) / share
    directions = np.hstack([lift.normals[:, some] for lift, some in parts])
    normals = unit(np.stack([np.bincount(numbers, row) for row in directions]))
    begin = 0
    for lift, some in parts:
        number = numbers[begin : begin + some.size]
        begin += some.size
        common = share[number] > 1
        lift.heights[some[common]] = heights[number[common]]
        lift.normals[:, some[common]] = normals[:, number[common]]
