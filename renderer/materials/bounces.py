"""Rays that leave mirrors, and glass by Snell's law and Fresnel's formulas."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.materials.optics import fresnel, reflected, refracted
from renderer.math.arrays import Floats, Integers, Masks
from renderer.waves import Wave, leaving


@dataclass(frozen=True, slots=True, eq=False)
class Bounces:
    """Coefficients of secondary rays by material.

    Attributes
    ----------
    strengths : (materials,) float64
        0 for those that send no such rays.
    depths : (materials,) int64
        Most bounces of a path, where it bounces.
    faintest : float
        Throughput cut-off.
    """

    strengths: Floats
    depths: Integers
    faintest: float

    def chosen(self, points: Points, wave: Wave) -> Integers:
        """Points (M,) of a wave that rays leave."""
        materials = points.materials
        return np.flatnonzero((self.strengths[materials] > 0) & (self.depths[materials] > wave.depth))


@dataclass(frozen=True, slots=True, eq=False)
class MirrorRays(Bounces):
    """Stage: a reflected ray from every point of a mirror."""

    def run(self, points: Points, wave: Wave) -> tuple[Wave, ...]:
        """Rays from the points of a wave whose materials are mirrors."""
        chosen = self.chosen(points, wave)
        directions = reflected(
            points.viewers[:, chosen], points.shading_normals[:, chosen], points.normals[:, chosen]
        )
        shares = self.strengths[points.materials[chosen]]
        outside = ~points.flipped[chosen]
        return leaving(wave, points, chosen, directions, shares, outside, "mirror", self.faintest)


@dataclass(frozen=True, slots=True, eq=False)
class TransmittedRays(Bounces):
    """Stage: a reflected and a refracted ray from every point of a transparent material.

    Attributes
    ----------
    indices : (materials,) float64
        Refractive index inside relative to outside; inside is behind the outward normal.
    materials : (shapes,) int64
        Material of each shape.
    """

    indices: Floats
    materials: Integers

    def run(self, points: Points, wave: Wave) -> tuple[Wave, ...]:
        """Rays from the points of a wave whose materials are transparent."""
        materials, chosen = points.materials, self.chosen(points, wave)
        strengths, indices = self.strengths[materials[chosen]], self.indices[materials[chosen]]
        viewers, shading = points.viewers[:, chosen], points.shading_normals[:, chosen]
        normals, inside = points.normals[:, chosen], points.flipped[chosen]
        ratio = np.where(inside, indices, 1 / indices)
        passed = self._passed(points, wave, chosen)
        share = np.where(passed, 0.0, fresnel(viewers, shading, ratio))
        back = reflected(viewers, shading, normals)
        through = np.where(passed, -viewers, refracted(viewers, shading, normals, ratio))
        return (
            *leaving(wave, points, chosen, back, strengths * share, ~inside, "reflection", self.faintest),
            *leaving(
                wave, points, chosen, through, strengths * (1 - share), inside, "refraction", self.faintest
            ),
        )

    def _passed(self, points: Points, wave: Wave, chosen: Integers) -> Masks:
        """Mask of the chosen points (M,) at which their rays were already refracted.

        At an edge of glass a ray enters, or leaves, through two faces at one point. The first refracts it.
        """
        entered = wave.rays.origin_surfaces
        if entered is None:
            return np.zeros(chosen.size, dtype=bool)
        rays = points.rays[chosen]
        alike = self.materials[entered.shapes[rays]] == points.materials[chosen]
        return points.went_nowhere(chosen) & alike & (entered.outside[rays] == points.flipped[chosen])
