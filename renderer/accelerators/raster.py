"""Nearest hits of a pinhole's rays with many triangles, by rasterisation.

The candidates of a ray are the triangles of its cell of the picture that may cover it, without those behind
one that certainly does. Both tests are conservative, and the exact test decides among the candidates.
"""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from renderer.accelerators.intersection import TreeIntersector, offer_hits
from renderer.accelerators.screen_grids import PROJECTION_ERROR, ScreenTriangles, screen_triangles
from renderer.accelerators.trees import in_tree, tree_of
from renderer.cameras import Pinhole
from renderer.interaction import Rays, RayStage
from renderer.math.arrays import Floats, Integers, dot, taken
from renderer.shapes.family import Intersector, Outline
from renderer.shapes.triangles import Triangles

RAYS_AT_ONCE = 16384
"""Rays whose candidates are found at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Raster:
    """The triangles of a family as a camera sees them.

    Attributes
    ----------
    family : Triangles
    camera : Pinhole
    ahead : ScreenTriangles
    others : RayStage or None
        For triangles that may be seen and are not clearly in front of the camera.
    """

    family: Triangles
    camera: Pinhole
    ahead: ScreenTriangles
    others: RayStage | None

    @classmethod
    def of(cls, family: Triangles, camera: Pinhole) -> Self:
        """Project a family."""
        ahead = screen_triangles(family, camera)
        part = family.part(ahead.others)
        others: RayStage | None = None
        if in_tree(part):
            others = TreeIntersector(part, tree_of(part))
        elif part.numbers.size:
            others = Intersector(part, Outline.of(part.corners(), camera))
        return cls(family, camera, ahead, others)

    def offer(self, rays: Rays) -> None:
        """Offer camera rays their nearest hits."""
        if self.others is not None:
            self.others.run(rays)
        for start in range(0, rays.t.size, RAYS_AT_ONCE):
            chosen = np.arange(start, min(start + RAYS_AT_ONCE, rays.t.size))
            owners, items = self._candidates(rays, chosen)
            if owners.size:
                offer_hits(self.family, rays, chosen[owners], self.ahead.numbers[items])

    def _candidates(self, rays: Rays, chosen: Integers) -> tuple[Integers, Integers]:
        """Pairs of ray and triangle ahead that may be its nearest hit."""
        directions = taken(rays.directions, chosen)
        forward = dot(directions, self.camera.forward)
        scale = forward * self.ahead.pixel
        x, y = (dot(directions, axis) / scale for axis in (self.camera.right, self.camera.up))
        # Hits count in units of the directions, and triangles know their depth.
        reach = rays.t[chosen] * forward * (1 + PROJECTION_ERROR)
        found = [self._covering(grid.candidates(x, y), x, y, reach) for grid in self.ahead.grids]
        if not found:
            return np.arange(0), np.arange(0)
        owners, items = (np.concatenate(part) for part in zip(*found, strict=True))
        near = np.flatnonzero(self.ahead.nearest[items] <= reach[owners])
        return owners[near], items[near]

    def _covering(
        self, pairs: tuple[Integers, Integers], x: Floats, y: Floats, reach: Floats
    ) -> tuple[Integers, Integers]:
        """Pairs whose triangle may cover the ray's place; brings `reach` down to those that surely do."""
        owners, items = pairs
        possible, sure = self.ahead.inside(x[owners], y[owners], items)
        np.minimum.at(reach, owners[sure], self.ahead.farthest[items[sure]])
        return owners[possible], items[possible]


@dataclass(slots=True)
class RasterIntersector:
    """Stage: the nearest hits of a block of rays with many triangles.

    Camera rays find their triangles on the screen, and rays from anywhere else through the tree. The same
    exact test decides, so either way gives the same bits.

    Attributes
    ----------
    tree : TreeIntersector
    camera : Pinhole
        Without a lens.
    """

    tree: TreeIntersector
    camera: Pinhole
    _raster: Raster | None = field(init=False, default=None)

    @property
    def family(self) -> Triangles:
        """The triangles."""
        return self.tree.family

    def run(self, rays: Rays) -> None:
        """Offer hits."""
        if rays.screen is None:
            self.tree.run(rays)
            return
        # Built for the first camera ray: explaining or pricing a plan does not need it.
        if self._raster is None:
            self._raster = Raster.of(self.family, self.camera)
        self._raster.offer(rays)
