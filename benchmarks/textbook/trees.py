"""Hits of many triangles through a tree, by slabs in float32 that allow for no rounding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.single import SINGLE, STEP, Singles
from renderer.accelerators.bvh import NOTHING
from renderer.accelerators.intersection import TreeIntersector
from renderer.math.arrays import cross, dot, taken

if TYPE_CHECKING:
    from renderer.accelerators.bvh import Level, Visits
    from renderer.interaction import Rays
    from renderer.math.arrays import Integers


@dataclass(frozen=True, slots=True)
class TextbookTree(TreeIntersector):
    """Stage: the nearest hits of a block of rays with triangles, family and tree in float32."""

    def _traverse(self, rays: Rays, chosen: Integers, levels: tuple[Level, ...], start: Visits) -> Visits:
        origins, directions = rays.origins_at(chosen), taken(rays.directions, chosen)
        visits, reach = start, rays.t[chosen].astype(SINGLE)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = np.reciprocal(directions)
            for level in levels:
                begin = origins if origins.shape[1] == 1 else taken(origins, visits.rays)
                near, far = _slabs(level, visits.nodes, begin, taken(inverse, visits.rays))
                np.minimum(far, reach[visits.rays], out=far)
                visits = level.below(visits, near <= far, (near, far))
        return visits

    def _intersect_items(self, rays: Rays, owners: Integers, items: Integers) -> None:
        filled = np.flatnonzero(items != NOTHING)
        owners, triangles = owners[filled // items.shape[1]], items.reshape(-1)[filled]
        pairs, t, u, v = _moeller_trumbore(
            taken(self.family.vertices, triangles), rays.origins_at(owners), taken(rays.directions, owners)
        )
        order = np.lexsort((t, owners[pairs]))
        best = order[np.flatnonzero(np.diff(owners[pairs][order], prepend=-1))]
        triangle = triangles[pairs[best]]
        rays.offer(
            owners[pairs[best]],
            t[best],
            (u[best], v[best]),
            self.family.numbers[triangle],
            self.family.primitives[triangle],
        )


def _slabs(level: Level, nodes: Integers, origins: Singles, inverse: Singles) -> tuple[Singles, Singles]:
    """Where rays enter and leave the children's boxes, (children, P) each, not before they begin."""
    shape = (level.children, nodes.size)
    near, far, distances = np.zeros(shape, SINGLE), np.full(shape, np.inf, SINGLE), np.empty(shape, SINGLE)
    for axis in range(3):
        down = np.signbit(inverse[axis])
        for upper, nearest, out in ((down, np.maximum, near), (~down, np.minimum, far)):
            np.take(level.sides[axis], nodes + upper * level.nodes, axis=1, out=distances, mode="clip")
            np.subtract(distances, origins[axis], out=distances)
            np.multiply(distances, inverse[axis], out=distances)
            nearest(out, distances, out=out)
    return near, far


def _moeller_trumbore(
    vertices: Singles, origins: Singles, directions: Singles
) -> tuple[Integers, Singles, Singles, Singles]:
    """Pairs (P,) that hit, and their t, u and v."""
    first_vertex = vertices[0]
    first, second, away = vertices[1] - first_vertex, vertices[2] - first_vertex, origins - first_vertex
    across = cross(directions, second)
    beside = cross(away, first)
    inverse = np.reciprocal(dot(first, across))
    u, v, t = (
        dot(away, across) * inverse,
        dot(directions, beside) * inverse,
        dot(second, beside) * inverse,
    )
    found = np.flatnonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (t > STEP))
    return found, t[found], u[found], v[found]
