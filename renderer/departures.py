"""Where rays begin that leave a surface: what they must not meet at once, and which side they came from."""

from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, magnitude
from renderer.math.numerics import NEARER
from renderer.math.streams import Keys

NEAR = 2.0**-40
"""A ray shorter than this share of its origin's magnitudes ends where it began.

Hundreds of roundings, so that they tell the sides of all planes at its end from a longer one's origin.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """The surfaces that N rays leave.

    No ray is moved off its surface by any length: shapes know the rays that begin on them.

    Attributes
    ----------
    shapes, primitives : (N,) int64
        What each ray leaves.
    outside : (N,) bool
        Whether it goes to the outward side.
    sizes : (N,) float64
        Sum of the magnitudes that formed the origin, scene units.
    before : (3, 1) or (3, N) float64
        Where the rays came from that came before. A plane that the new origin touches is on that side,
        because they did not pass the plane.
    paths : (N,) uint64
        Name of the bounces so far; 0 is that of camera rays.
    walked : (N,) float64
        Length of the path so far, scene units.
    """

    shapes: Integers
    primitives: Integers
    outside: Masks
    sizes: Floats
    before: Floats
    paths: Keys
    walked: Floats

    def before_at(self, index: Integers) -> Floats:
        """Origins before of some rays, (3, 1) if all share one."""
        return self.before if self.before.shape[1] == 1 else self.before[:, index]

    def came_from(self, index: Integers, origins: Floats, ways: Floats) -> Floats:
        """Where the path of some rays came from, (3, M): their `origins`, unless they went nowhere.

        In a corner of mirrors a ray may end where it began but for rounding, `ways` (3, M) from there: its
        origin is then on no side of the walls that meet there, and the ray before tells.
        """
        near = magnitude(ways) <= NEAR * self.sizes[index]
        return np.where(near, self.before_at(index), origins)

    def leaves(self, rays: Integers, shapes: Integers, primitives: Integers) -> Masks:
        """Whether some rays leave these primitives, (M,)."""
        return (self.shapes[rays] == shapes) & (self.primitives[rays] == primitives)


def settled(distances: Floats, bounds: Floats, before: Floats) -> Floats:
    """Signed distances of origins, those within `bounds` moved to the side of the origins before.

    They stand next to nothing away on that side, so that a ray which meets the plane there goes nowhere.
    Where the origins before touch as well, the plane is met no more: the result is 0.
    """
    sides = np.where(np.abs(before) <= bounds, 0.0, np.sign(before))
    return np.where(np.abs(distances) <= bounds, sides * (NEARER * bounds), distances)
