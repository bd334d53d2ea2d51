r"""Self-intersection: the side of a touched surface on which a ray begins, decided without an epsilon.

A hit is rebuilt on its surface, but float64 puts it a rounding above or below that, and likewise above or
below every surface that shares an edge or a corner with it. Where the computed distance may have either sign,
the path decides instead::

             o       q          o: previous origin; q: next hit, or a point of a light
              \     /
               \   /            the side of o
      - - - - - \ / - - - - -   + bound
      ===========V===========   plane of a surface that x touches
      - - - - - -x- - - - - -   - bound

1. *The surface that a ray leaves.* A flat one is not hit again, and shades none of its own points: its
   distance is 0. A convex one is hit again, and shades, only from inside; its normal decides that.
2. *Another surface within the bound* is touched. The path came from `o` and did not pass it, so x stands on
   the side of o: `TOUCHING_DISTANCE` bounds away, next to nothing, so that a ray which hits it there has
   length zero.
3. *If o is within its bound too*, nothing distinguishes the sides: the distance is 0 and the surface is not
   hit.
4. *Beyond the bound* the computed sign holds.

Rays that begin in the open, as those of cameras and of `trace`, have no previous origin: a surface that
their origin touches is not hit. The bounds are roundings (`numerics.PLANE_ERROR`, `numerics.gamma`) of the
magnitudes that formed point and surface, never a length. Rules 1 to 4 are `settled`, for rays and for
segments to a light alike; `OriginSurfaces` carries what they need from hit to hit.
"""

from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, magnitude
from renderer.math.streams import Keys

TOUCHING_DISTANCE = 2.0**-20
"""Assumed distance of a point from a plane that it touches, over the bound on its rounding error.

A segment at an angle of 1e-6 to the plane passes it no farther than that rounding from the point.
"""

ZERO_LENGTH = 2.0**-40
"""A ray shorter than this, relative to its origin's magnitudes, has length zero.

Hundreds of roundings, so that the origin of a longer one is on a definite side of all planes at its end.
"""


@dataclass(frozen=True, slots=True, eq=False)
class OriginSurfaces:
    """The surfaces that N rays leave.

    No ray is moved off its surface by any length: shapes know the rays that begin on them.

    Attributes
    ----------
    shapes, primitives : (N,) int64
        The surface that each ray leaves.
    outside : (N,) bool
        Whether it goes to the outward side.
    sizes : (N,) float64
        Sum of the magnitudes that formed the origin, scene units.
    previous_origins : (3, 1) or (3, N) float64
        Origins of the rays before these.
    paths : (N,) uint64
        Name of the bounces so far; 0 is that of camera rays.
    path_lengths : (N,) float64
        Length of the path so far, scene units.
    """

    shapes: Integers
    primitives: Integers
    outside: Masks
    sizes: Floats
    previous_origins: Floats
    paths: Keys
    path_lengths: Floats

    def previous_origins_at(self, index: Integers) -> Floats:
        """Previous origins of some rays, (3, 1) if all share one."""
        every = self.previous_origins
        return every if every.shape[1] == 1 else every[:, index]

    def origins_before_hits(self, index: Integers, origins: Floats, ways: Floats) -> Floats:
        """Previous origins of the hits of some rays, (3, M): their `origins`, but for rays of zero length.

        In a corner of mirrors a ray may end where it began but for rounding, `ways` (3, M) from there: its
        origin is then on no side of the walls that join there, and the ray before decides.
        """
        near = magnitude(ways) <= ZERO_LENGTH * self.sizes[index]
        return np.where(near, self.previous_origins_at(index), origins)

    def part(self, index: Integers) -> "OriginSurfaces":
        """Select rays."""
        return OriginSurfaces(
            self.shapes[index],
            self.primitives[index],
            self.outside[index],
            self.sizes[index],
            self.previous_origins_at(index),
            self.paths[index],
            self.path_lengths[index],
        )

    @classmethod
    def joined(cls, every: list["OriginSurfaces"]) -> "OriginSurfaces":
        """Concatenate several sets of rays."""
        previous = [np.broadcast_to(each.previous_origins, (3, each.sizes.size)) for each in every]
        return cls(
            np.concatenate([each.shapes for each in every]),
            np.concatenate([each.primitives for each in every]),
            np.concatenate([each.outside for each in every]),
            np.concatenate([each.sizes for each in every]),
            np.concatenate(previous, axis=1),
            np.concatenate([each.paths for each in every]),
            np.concatenate([each.path_lengths for each in every]),
        )

    def are(self, rays: Integers, shapes: Integers, primitives: Integers) -> Masks:
        """Whether some rays leave these primitives, (M,)."""
        return (self.shapes[rays] == shapes) & (self.primitives[rays] == primitives)


def previous_sides(distances: Floats, bounds: Floats) -> Floats:
    """Sides -1 or 1 that previous origins are on by their signed distances, 0 where they touch as well."""
    return np.where(np.abs(distances) <= bounds, 0.0, np.sign(distances))


def settled(distances: Floats, bounds: Floats, sides: Floats, own: Masks) -> Floats:
    """Signed distances of points from surfaces whose signs hold.

    Parameters
    ----------
    distances, bounds : (K, N) or (N,) float64
        As computed, and what rounding may move them by.
    sides : float64
        Of the previous origins: -1, 0 or 1.
    own : bool
        Where the point lies on the very surface.
    """
    touching = np.abs(distances) <= bounds
    return np.where(own, 0.0, np.where(touching, sides * (TOUCHING_DISTANCE * bounds), distances))
