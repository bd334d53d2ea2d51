"""Hits of many triangles through a tree, by slabs in float32 that allow for no rounding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.single import SINGLE, STEP, Singles
from renderer.accelerators.bvh import NOTHING, Level, Visits, from_root, turns
from renderer.accelerators.meeting import PORTION, TreeMeeting
from renderer.arrays import cross, dot

if TYPE_CHECKING:
    from renderer.arrays import Integers
    from renderer.interaction import Rays


@dataclass(frozen=True, slots=True)
class TextbookTree(TreeMeeting):
    """Stage: the nearest hits of a block of rays with triangles, family and tree in float32."""

    def run(self, rays: Rays) -> None:
        """Offer hits, nearest leaves first, so that leaves behind them are left out."""
        for start in range(0, rays.t.size, PORTION):
            chosen = np.arange(start, min(start + PORTION, rays.t.size))
            visits = self._visits(rays, chosen)
            if visits.rays.size:
                self._meet_leaves(rays, chosen, visits)

    def _visits(self, rays: Rays, chosen: Integers) -> Visits:
        origins, directions = rays.origins_at(chosen), rays.directions[:, chosen]
        visits, reach = from_root(np.arange(chosen.size)), rays.t[chosen].astype(SINGLE)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = np.reciprocal(directions)
            for level in self.tree.levels:
                begin = origins if origins.shape[1] == 1 else np.take(origins, visits.rays, axis=1)
                near, far = _slabs(level, visits.nodes, begin, np.take(inverse, visits.rays, axis=1))
                np.minimum(far, reach[visits.rays], out=far)
                visits = level.below(visits, np.maximum(near, 0) <= far, near)
        return visits

    def _meet_leaves(self, rays: Rays, chosen: Integers, visits: Visits) -> None:
        order = np.lexsort((visits.entries, visits.rays))
        owners, leaves, entries = visits.rays[order], visits.nodes[order], visits.entries[order]
        for turn in turns(owners):
            now = turn[entries[turn] <= rays.t[chosen[owners[turn]]]]
            self._meet_items(rays, chosen[owners[now]], self.tree.items[leaves[now]])

    def _meet_items(self, rays: Rays, owners: Integers, items: Integers) -> None:
        filled = items != NOTHING
        triangles = items[filled]
        owners = np.broadcast_to(owners[:, None], items.shape)[filled]
        pairs, t, u, v = _moeller_trumbore(
            self.family.vertices[:, :, triangles], rays.origins_at(owners), rays.directions[:, owners]
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
    """Where rays enter and leave the children's boxes, (children, P) each."""
    near = np.full((level.children, nodes.size), -np.inf, SINGLE)
    far = np.full(near.shape, np.inf, SINGLE)
    first, second, other = (np.empty(near.shape, SINGLE) for _ in range(3))
    for axis in range(3):
        for sides, out in ((level.low, first), (level.high, second)):
            np.take(sides[axis], nodes, axis=1, out=out, mode="clip")
            np.subtract(out, origins[axis], out=out)
            np.multiply(out, inverse[axis], out=out)
        np.maximum(near, np.minimum(first, second, out=other), out=near)
        np.minimum(far, np.maximum(first, second, out=other), out=far)
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
