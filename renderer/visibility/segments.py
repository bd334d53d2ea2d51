"""Shadows of any family: segments to light points, intersected as rays are.

They are correct for every family, one light point at a time in float64; most have faster ones.
"""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Rays
from renderer.lights.view import LightView
from renderer.math.arrays import taken
from renderer.shapes.family import HULL_MARGIN, Family


@dataclass(frozen=True, slots=True, eq=False)
class SegmentShadows:
    """Stage of a light: shadows of one family."""

    family: Family

    def run(self, view: LightView) -> None:
        """Block the pairs with a shape strictly between."""
        open_points = view.open_points()
        if not open_points.size:
            return
        chosen, start = view.chosen[open_points], view.points
        emitter = view.emitter
        centre, origins = taken(view.towards, open_points), taken(start.positions, chosen)
        surfaces = start.origin_surfaces(chosen)
        blocked = np.zeros((view.light_points.count, open_points.size), dtype=bool)
        for row, u, v in zip(blocked, *view.light_points.places(open_points), strict=True):
            towards = centre + emitter.first * u + emitter.second * v
            rays = Rays(
                origins, towards, start.pixels[chosen], start.samples[chosen], origin_surfaces=surfaces
            )
            for shape in range(self.family.numbers.size):
                self.family.intersect(shape, rays)
            row[...] = rays.t < (1 - HULL_MARGIN if emitter.weight else np.inf)
        view.block(blocked, open_points)
