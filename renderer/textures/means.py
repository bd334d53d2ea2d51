"""Mean colours of textures over whole pixels, exact where perspective bends a pixel's footprint.

A pixel's place (x, y), from -1/2 to 1/2, shows the texture coordinates c + S (x, y) / (1 + g . (x, y)) of a
plane: S has the footprint's sides, and g says how fast the depth changes. For g = 0 the footprint is a
parallelogram. Elsewhere the pixel is cut into squares, whose footprints bend less.
"""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.textures import Texture

PARALLELOGRAM_ERROR = 2.0**-6
"""Error of the mean over one parallelogram for a contrast of 1 and g = 1, measured on chess boards."""

MEAN_ERROR_SHARE = 1 / 8
"""Largest error of a pixel's mean, relative to the target error."""

MOST_CUTS = 16
"""Squares along a side of a pixel."""

MIN_DEPTH_SHARE = 2.0**-4
"""Least share of its depth that a part of a pixel may have: the horizon is beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class MeanColor:
    """Stage: mean colours, over the pixel, of materials that use one texture.

    Attributes
    ----------
    texture : Texture
        That gives means over parallelograms.
    used : (materials,) bool
    across, along : (3, 1) float64
        Change of a camera ray's direction across a pixel.
    error : float
        The target, linear radiance.
    """

    texture: Texture
    used: Masks
    across: Floats
    along: Floats
    error: float

    def run(self, points: Points) -> None:
        """Look up the mean colours of the points of these materials."""
        chosen = np.flatnonzero(self.used[points.materials])
        bends = self._bends(points, chosen)
        steepest = np.abs(bends).max(axis=0, initial=0.0)
        cuts = np.sqrt(PARALLELOGRAM_ERROR * steepest / (MEAN_ERROR_SHARE * self.error))
        cuts = np.exp2(np.ceil(np.log2(np.clip(cuts, 1, MOST_CUTS)))).astype(np.int64)
        for count in np.unique(cuts).tolist():
            alike = np.flatnonzero(cuts == count)
            points.colors[:, chosen[alike]] = self._means(points, chosen[alike], bends[:, alike], count)
        points.lookups += chosen.size

    def _bends(self, points: Points, chosen: Integers) -> Floats:
        """The vectors g (2, m); 0 for rays that have bounced, whose footprints are estimates."""
        normals, directions = points.normals[:, chosen], points.directions[:, chosen]
        depth = dot(normals, directions)
        seen = (points.paths[chosen] == 0) & (depth != 0)
        slopes = np.stack([dot(normals, part) for part in (self.across, self.along)])
        return np.divide(slopes, depth, out=np.zeros_like(slopes), where=seen)

    def _means(self, points: Points, chosen: Integers, bends: Floats, count: int) -> Floats:
        """Means (3, m) over pixels cut into `count` squares a side."""
        centers, sides = points.coordinates[:, chosen], points.footprints_at(chosen)
        if count == 1 or sides is None:
            return self.texture.at(centers, sides)
        middles = (np.arange(count) + 0.5) / count - 0.5
        total = np.zeros((3, chosen.size))
        for place in np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2, 1):
            depth = np.maximum(1 + (bends * place).sum(axis=0), MIN_DEPTH_SHARE)
            away = (sides * place).sum(axis=1) / depth
            total += self.texture.at(centers + away, (sides - away[:, None] * bends) / (depth * count))
        return total / count**2
