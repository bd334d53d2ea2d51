"""Borders that displaced shapes have in common: cut and moved alike, so that no crack opens between them.

Only shapes of one relief, which is a height map and a height, are joined, and only where both end: on edges
that one triangle of each has to itself, with corners that agree bit for bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, put, taken, unit
from renderer.shapes.meshes import place_numbers

EDGES = ((0, 1), (1, 2), (2, 0))


@dataclass(slots=True, eq=False)
class Lift:
    """Displacement of the vertices of fine meshes.

    Attributes
    ----------
    positions : (3, P) float64
        Of each shape each once.
    shapes : (P,) int64
        Number of the shape that has each place.
    owner : (V,) int64
        Place of each vertex.
    normals : (3, P) float64
        Unit.
    heights : (P,) float64
        Scene units.
    border : (P,) bool
        Places where their shape ends.
    """

    positions: Floats
    shapes: Integers
    owner: Integers
    normals: Floats
    heights: Floats
    border: Masks

    def moved(self) -> Floats:
        """Displaced vertices, (3, V)."""
        return taken(self.positions + self.normals * self.heights, self.owner)


def corner_places(corners: Floats, owners: Integers) -> Integers:
    """Number of the place of each corner, (3, T), of triangles with corners (3, 3, T) and owners (T,)."""
    vertices = corners.transpose(1, 0, 2).reshape(3, -1)
    return place_numbers(vertices, np.tile(owners, 3)).reshape(3, -1)


def open_edges(corners: Floats, shapes: Integers) -> Masks:
    """Edges (3, T) from corner to corner that each triangle has to itself, in its shape (T,)."""
    names = _named(corner_places(corners, shapes))
    _, which, count = np.unique(names, return_inverse=True, return_counts=True)
    return np.asarray(count[which.reshape(-1)].reshape(3, -1) == 1)


def _named(points: Integers) -> Integers:
    """One number for each edge (3 * T,) of triangles between points (3, T), whichever way round."""
    pairs = [points[list(edge)] for edge in EDGES]
    base = points.max() + 1
    return np.concatenate([pair.min(axis=0) * base + pair.max(axis=0) for pair in pairs])


def neighbours(corners: Floats, shapes: Integers, reliefs: Integers) -> Integers:
    """The same number (shapes,) for shapes that have open edges in common, or neighbours that do.

    Parameters
    ----------
    corners : (3, 3, T) float64
    shapes : (T,) int64
        Number of the shape of each triangle.
    reliefs : (shapes,) int64
        Only shapes of the same relief have edges in common.
    """
    names = _named(corner_places(corners, reliefs[shapes]))
    alone = np.flatnonzero(open_edges(corners, shapes))
    order = alone[np.argsort(names[alone], kind="stable")]
    same = np.flatnonzero(names[order[1:]] == names[order[:-1]])
    owners = np.tile(shapes, 3)[order]
    return _connected(reliefs.size, owners[same], owners[same + 1])


def _connected(count: int, a: Integers, b: Integers) -> Integers:
    """The least number of all that pairs of numbers (P,) below `count` lead to, (count,)."""
    labels = np.arange(count)
    while True:
        least, before = np.minimum(labels[a], labels[b]), labels.copy()
        # The labels of a pair get the lesser label, too, so that chains end in few rounds.
        for part in (labels[a], labels[b]):
            np.minimum.at(labels, part, least)
        labels = labels[labels]
        if np.array_equal(labels, before):
            return labels


def join(lifts: Sequence[Lift], reliefs: Integers) -> None:
    """Give border places that several shapes of a relief have one normal and height: the means of theirs."""
    chosen = [np.flatnonzero(lift.border) for lift in lifts]
    parts = list(zip(lifts, chosen, strict=True))
    shapes = np.concatenate([lift.shapes[some] for lift, some in parts])
    positions = np.hstack([taken(lift.positions, some) for lift, some in parts])
    heights = np.concatenate([lift.heights[some] for lift, some in parts])
    directions = np.hstack([taken(lift.normals, some) for lift, some in parts])
    # Sums in the order of the scene do not depend on how shapes are grouped.
    order = np.argsort(shapes, kind="stable")
    numbers = place_numbers(positions, reliefs[shapes])
    ordered = numbers[order]
    share = np.bincount(numbers)
    heights = np.bincount(ordered, heights[order]) / share
    normals = unit(np.stack([np.bincount(ordered, row[order]) for row in directions]))
    for (lift, some), number in zip(
        parts, np.split(numbers, np.cumsum([some.size for some in chosen])[:-1]), strict=True
    ):
        common = share[number] > 1
        lift.heights[some[common]] = heights[number[common]]
        put(lift.normals, some[common], taken(normals, number[common]))
