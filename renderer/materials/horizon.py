"""Shading normals that point away from the viewer, bent to the horizon."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.math.arrays import Floats, Integers, dot, lengths, unit
from renderer.shapes.frames import SHORT


@dataclass(frozen=True, slots=True)
class Horizon:
    """Stage: what smooth normals, normal maps and bump maps turned away from the viewer is turned back.

    A point that is seen cannot face away. Its normal keeps the part across the line of sight, which joins
    the normals on this side of the horizon without a jump; turning it over instead would put light where
    the surface faces away from it, and cutting it off would leave a black hole. It runs after all stages
    that tilt normals, once, so that a flat map is no map.
    """

    def run(self, points: Points) -> None:
        """Bend the normals that need it."""
        away = np.flatnonzero(dot(points.shading_normals, points.viewers) <= 0)
        if away.size:
            points.shading_normals[:, away] = _at_horizon(points, away)


def _at_horizon(points: Points, away: Integers) -> Floats:
    """Unit normals (3, m) across the line of sight.

    One that points straight away, or is 0 because the normals around it cancel, says nothing about a
    direction across: there the true normal stands in.
    """
    normals, viewers = points.shading_normals[:, away], points.viewers[:, away]
    across = normals - viewers * dot(normals, viewers)
    return np.where(lengths(across) > SHORT, unit(across), points.normals[:, away])
