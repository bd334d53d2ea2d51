"""Discs around the triangles of a node, which bound its height above a plane that grazes its surface.

The box of a piece of a smooth surface sticks out of it by about its own size, so many neighbours' boxes
rise above the horizon of a point on the surface. A disc along the surface sticks out by far less.
"""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.bvh import NO_ITEM
from renderer.math.arrays import Floats, Integers, dot, lengths, magnitude, unit
from renderer.math.numerics import gamma
from renderer.shapes.triangles import Triangles


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """Bounds of the triangles below M nodes.

    Attributes
    ----------
    values : (8, M) float64
        Centre, axis, radius around the centre, and thickness on each side along the axis, rounding included.
    """

    values: Floats

    def heights(self, normals: Floats, nodes: Integers) -> Floats:
        """At least the greatest normal . x over the places x in nodes (P,), for unit normals (3, P).

        With a = normal . axis a place in the disc is at most `thickness` * |a| + radius * sqrt(1 - a**2)
        above the centre. The sum of both factors is at least 1, and so is that of what rounding adds.
        """
        values = np.take(self.values, nodes, axis=1, mode="clip")
        centers, axes, radii, thicknesses = values[:3], values[3:6], values[6], values[7]
        along = dot(normals, axes)
        across = np.sqrt(1 + gamma(64) - along * along)
        return dot(normals, centers) + thicknesses * np.abs(along) + radii * across


def discs_of(family: Triangles, items: Integers, low: Floats, high: Floats) -> Discs:
    """Discs around triangles `items` (M, m), of which `NO_ITEM` is none, in boxes (3, M).

    Each node has one triangle at least.
    """
    held = np.where(items == NO_ITEM, items.max(axis=1, keepdims=True), items).T
    axes = unit(np.take(family.normals, held, axis=1, mode="clip").sum(axis=1))
    centers = low + (high - low) / 2
    radii, thicknesses = np.zeros(held.shape[1]), np.zeros(held.shape[1])
    for row in held:
        for vertex in family.vertices:
            beside = np.take(vertex, row, axis=1, mode="clip") - centers
            np.maximum(radii, lengths(beside), out=radii)
            np.maximum(thicknesses, np.abs(dot(axes, beside)), out=thicknesses)
    room = gamma(64) * (magnitude(centers) + radii)
    return Discs(np.concatenate((centers, axes, (radii + room)[None], (thicknesses + room)[None])))
