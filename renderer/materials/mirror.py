"""Mirrors: what a surface shows of the scene before it."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.materials.optics import reflected
from renderer.math.arrays import Floats, Integers
from renderer.waves import Wave, leaving


@dataclass(frozen=True, slots=True, eq=False)
class MirrorRays:
    """Stage: a reflected ray from every point of a mirror.

    Attributes
    ----------
    strengths : (materials,) float64
    depths : (materials,) int64
        Most bounces of a path, where it bounces.
    faintest : float
        Weight up to which no picture shows a path.
    """

    strengths: Floats
    depths: Integers
    faintest: float

    def run(self, points: Points, wave: Wave) -> tuple[Wave, ...]:
        """Rays from the points of a wave whose materials are mirrors."""
        materials = points.materials
        chosen = np.flatnonzero((self.strengths[materials] > 0) & (self.depths[materials] > wave.depth))
        directions = reflected(
            points.viewers[:, chosen], points.shading_normals[:, chosen], points.normals[:, chosen]
        )
        shares = self.strengths[materials[chosen]]
        outside = ~points.flipped[chosen]
        return leaving(wave, points, chosen, directions, shares, outside, "mirror", self.faintest)
