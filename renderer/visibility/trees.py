"""Shadows of many triangles.

Points traverse the tree with the shaft to the whole light, which rules most of it out. The number of nodes
that a point hits decides how to continue: if there are few, down to the leaves, where pairs of point and
triangle are compared with all light points at once; if there are many, with one ray for each light point. The
choice depends on the point alone, so no pixel depends on its neighbours.
"""

from dataclasses import dataclass, field

import numpy as np

from renderer.accelerators.bvh import NO_ITEM, Visits, from_root
from renderer.accelerators.discs import Discs
from renderer.accelerators.shafts import Shafts, visits_of_shafts
from renderer.accelerators.trees import Tree
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Integers, Pairs, dot
from renderer.shapes.triangles import Triangles
from renderer.visibility.light_frame import LightFrame
from renderer.visibility.shafts import shafts_of
from renderer.visibility.tree_pairs import PairShadows
from renderer.visibility.tree_rays import RayShadows

POINTS_AT_ONCE = 8192
"""Points that traverse the tree at once; half and twice as many are slower on study/shell."""

SHAFT_LEVELS = 3
"""Levels that all points traverse with the shaft to the whole light."""

FEW_NODES = (8, 96)
"""Nodes above which a point sends rays: in the last of these levels, and in each level below."""

FEW_TRIANGLES = 256
"""Most triangles that are compared with all light points at once."""

LEAVES_AT_ONCE = 4096
"""Leaf visits whose triangles are culled at once: their twenty or so temporaries stay in cache."""


@dataclass(slots=True)
class TreeShadows:
    """Shadow stage: triangles in a tree between points and one light.

    Attributes
    ----------
    family : Triangles
    tree : Tree
    emitter : Emitter
    dtype : float32 or float64
        Of the work for each light point.
    """

    family: Triangles
    tree: Tree
    emitter: Emitter
    dtype: np.dtype[np.floating]
    frame: LightFrame | None = field(init=False)
    pairs: PairShadows = field(init=False)
    rays: RayShadows = field(init=False)

    def __post_init__(self) -> None:
        """Form the triangles' coordinates once, and make both ways to continue."""
        self.frame = LightFrame.of(self.family, self.emitter)
        self.pairs = PairShadows(self.family, self.emitter, self.dtype)
        self.rays = RayShadows(self.family, self.tree, self.emitter)

    def run(self, view: LightView) -> None:
        """Mark the blocked pairs of a view."""
        shafts = shafts_of(view, float(self.family.sizes.max()))
        pyramids = None if self.frame is None else self.frame.pyramids(view)
        open_ = view.open_points()
        for start in range(0, open_.size, POINTS_AT_ONCE):
            self._run(view, shafts, pyramids, open_[start : start + POINTS_AT_ONCE])

    def _run(self, view: LightView, shafts: Shafts, pyramids: Pairs | None, index: Integers) -> None:
        levels = self.tree.levels
        visits = visits_of_shafts(levels[:SHAFT_LEVELS], shafts, from_root(index))
        visits = self._few(view, shafts, visits, SHAFT_LEVELS, FEW_NODES[0])
        for number in range(SHAFT_LEVELS, len(levels) - 1):
            visits = visits_of_shafts(levels[number : number + 1], shafts, visits)
            visits = self._few(view, shafts, visits, number + 1, FEW_NODES[1])
        for level in levels[max(SHAFT_LEVELS, len(levels) - 1) :]:
            visits = visits_of_shafts((level,), shafts, self._risen(shafts, visits, self.tree.discs[1]))
        self._compare(view, shafts, pyramids, visits)

    def _few(self, view: LightView, shafts: Shafts, visits: Visits, level: int, most: int) -> Visits:
        """Send rays from points that have hit more nodes of a level than that; return the others' visits."""
        few = np.bincount(visits.rays, minlength=view.count)[visits.rays] <= most
        self.rays.mark(view, shafts.points, visits.chosen(~few), min(level, len(self.tree.levels)))
        return visits.chosen(few)

    def _compare(self, view: LightView, shafts: Shafts, pyramids: Pairs | None, visits: Visits) -> None:
        """Compare the triangles in leaves with all light points, or send rays where there are many."""
        visits = self._risen(shafts, visits, self.tree.discs[0])
        points, triangles = self._triangles(pyramids, visits)
        count = np.bincount(points, minlength=view.count)
        few = count[points] <= FEW_TRIANGLES
        self.pairs.mark(view, shafts.points, points[few], triangles[few])
        many = visits.chosen(count[visits.rays] > FEW_TRIANGLES)
        self.rays.mark(view, shafts.points, many, len(self.tree.levels))

    def _risen(self, shafts: Shafts, visits: Visits, discs: Discs) -> Visits:
        """Visits of nodes that may rise above the horizon of their point."""
        normals = np.take(shafts.normals, visits.rays, axis=1, mode="clip")
        lowest = (dot(shafts.normals, shafts.points) - shafts.slack)[visits.rays]
        return visits.chosen(discs.heights(normals, visits.nodes) >= lowest)

    def _triangles(self, pyramids: Pairs | None, visits: Visits) -> tuple[Integers, Integers]:
        """Pairs of point and triangle of the leaves, sorted by point, but for triangles beside the light."""
        starts = range(0, max(1, visits.rays.size), LEAVES_AT_ONCE)
        blocks = [slice(start, start + LEAVES_AT_ONCE) for start in starts]
        parts = [self._triangles_of(pyramids, visits.rays[block], visits.nodes[block]) for block in blocks]
        points, triangles = zip(*parts, strict=True)
        return np.concatenate(points), np.concatenate(triangles)

    def _triangles_of(
        self, pyramids: Pairs | None, points: Integers, leaves: Integers
    ) -> tuple[Integers, Integers]:
        items = np.take(self.tree.items, leaves, axis=0, mode="clip")
        filled = np.flatnonzero(items != NO_ITEM)
        points, triangles = points[filled // items.shape[1]], items.reshape(-1)[filled]
        if self.frame is None or pyramids is None:
            return points, triangles
        kept = self.frame.overlapping(pyramids, points, triangles)
        return points[kept], triangles[kept]
