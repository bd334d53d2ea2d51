"""Shadows of many triangles.

Points walk the upper levels of the tree with the shaft to the whole light, which rules most of them out.
What they meet there says how to go on: few nodes, and pairs of point and triangle are compared with all light
points at once; many, and one ray a light point is sent. Which it is depends on the point alone, so no pixel
depends on its neighbours.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.accelerators.bvh import NOTHING, Bvh, Visits, from_root, visits_of_shafts
from renderer.arrays import Floats
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.shapes.triangles import Triangles
from renderer.visibility.tree_pairs import PairShadows
from renderer.visibility.tree_rays import RayShadows

POINTS = 2048
"""Points that walk the tree together."""

SHAFT_LEVELS = 3
"""Levels that all points walk with the shaft to the whole light."""

FEW_NODES = 8
"""Up to so many nodes of the last of these levels, a point goes on with its shaft."""


@dataclass(slots=True)
class TreeShadows:
    """Shadow stage: triangles in a tree between points and one light.

    Attributes
    ----------
    family : Triangles
    tree : Bvh
    emitter : Emitter
    dtype : float32 or float64
        Of the work for each light point.
    """

    family: Triangles
    tree: Bvh
    emitter: Emitter
    dtype: np.dtype[np.floating]
    pairs: PairShadows = field(init=False)
    rays: RayShadows = field(init=False)

    def __post_init__(self) -> None:
        """Make both ways to go on."""
        self.pairs = PairShadows(self.family, self.emitter, self.dtype)
        self.rays = RayShadows(self.family, self.tree, SHAFT_LEVELS, self.emitter)

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        positions = view.of_points(view.points.positions)
        for start in range(0, view.count, POINTS):
            portion = positions[:, start : start + POINTS]
            shafts = self._shafts(0, SHAFT_LEVELS, portion, from_root(portion.shape[1]))
            few = np.bincount(shafts.rays, minlength=portion.shape[1])[shafts.rays] <= FEW_NODES
            self.rays.mark(view, positions, _part(shafts, ~few, start))
            below = self._shafts(SHAFT_LEVELS, None, portion, _part(shafts, few, 0))
            items = self.tree.items[below.nodes]
            filled = items != NOTHING
            points = np.broadcast_to(below.rays[:, None], items.shape)[filled] + start
            self.pairs.mark(view, positions, points, items[filled])

    def _shafts(self, first: int, last: int | None, positions: Floats, start: Visits) -> Visits:
        ends = self.emitter.ends()
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        return visits_of_shafts(
            self.tree.levels[first:last], positions, low, high, self.emitter.weight, start
        )


def _part(visits: Visits, chosen: np.ndarray, offset: int) -> Visits:
    return Visits(visits.rays[chosen] + offset, visits.nodes[chosen], visits.entries[chosen])
