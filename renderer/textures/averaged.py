"""The exact mean of a checker board over a pixel.

The board is a product of two square waves s(x) s(y). With the triangle wave T, whose derivative is s, Green's
theorem makes its integral over a footprint that of T(x) s(y) dy around it. Between the places where an edge
passes a whole x or y, the integrand is linear, so that its value in the middle tells the integral.
"""

from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, taken
from renderer.textures.checker import BoxCheckerTexture, triangle_wave

MOST = 64.0
"""Fields that a side may span. Beyond, the mean over the box around the footprint is as good: within a
hundredth both have the mean colour."""

FLATTEST = 2.0**-20
"""A footprint is a box where its area is less than this share of that of a square on its longer side: an
area between edges so near to each other has few digits."""


@dataclass(frozen=True, slots=True)
class AveragedChecker:
    """A checker board averaged over footprints, which are parallelograms. Most of them lie in one field.

    Attributes
    ----------
    board : BoxCheckerTexture
    """

    board: BoxCheckerTexture

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Mean colours (3, N) around texture coordinates (2, N); those of points without footprints."""
        if footprints is None:
            return self.board.at(coordinates)
        repeat = self.board.board.repeat
        centers, sides = coordinates * repeat, footprints * repeat[:, None]
        reach = (np.abs(sides[:, 0]) + np.abs(sides[:, 1])) / 2
        first, last = np.floor(centers - reach), np.floor(centers + reach)
        waves = _signs(first[0] + first[1])
        torn = np.flatnonzero((first[0] != last[0]) | (first[1] != last[1]))
        waves[torn] = self._means(taken(centers, torn), taken(sides, torn))
        return self.board.mixed(waves)

    def _means(self, centers: Floats, sides: Floats) -> Floats:
        """Mean waves (n,) over footprints that reach into more than one field."""
        longest = np.abs(sides).max(axis=(0, 1))
        areas = np.abs(_areas(np.clip(sides, -MOST, MOST)))
        usable = (longest <= MOST) & (areas > FLATTEST * np.minimum(longest, MOST) ** 2)
        whole, boxes = np.flatnonzero(usable), np.flatnonzero(~usable)
        waves = np.empty(longest.size)
        waves[whole] = means_over(taken(centers, whole), taken(sides, whole))
        waves[boxes] = self.board.waves(taken(centers, boxes), taken(sides, boxes))
        return waves


def means_over(centers: Floats, sides: Floats) -> Floats:
    """Mean wave (n,) over parallelograms of centres (2, n) and sides (coordinate, side, n), in fields.

    Error at most some eps times (l + l * l) over the area, for a longer side l.
    """
    first, second = sides[:, 0], sides[:, 1]
    # Small numbers near the corner of fields that is nearest keep the digits of small footprints.
    nearest = np.rint(centers)
    corner = centers - nearest - (first + second) / 2
    starts = np.concatenate((corner, corner + first, corner + first + second, corner + second), axis=1)
    ways = np.concatenate((first, second, -first, -second), axis=1)
    # No part of an edge passes more than one whole x and one whole y.
    parts = np.maximum(np.ceil(np.abs(ways).max(axis=0)), 1).astype(np.int64)
    ends = np.cumsum(parts)
    numbers = np.arange(ends[-1] if ends.size else 0) - (ends - parts).repeat(parts)
    steps = (ways / parts).repeat(parts, axis=1)
    integrals = _along(starts.repeat(parts, axis=1) + numbers * steps, steps)
    around = np.add.reduceat(integrals, ends - parts).reshape(4, -1).sum(axis=0)
    return np.clip(around / _areas(sides), -1, 1) * _signs(nearest[0] + nearest[1])


def _along(starts: Floats, steps: Floats) -> Floats:
    """Integrals (m,) of T(x) s(y) dy along ways by `steps` (2, m) of a field at most."""
    ahead = np.floor(starts) + (steps > 0) - starts
    turns = np.divide(ahead, steps, out=np.ones_like(steps), where=steps != 0)
    np.clip(turns, 0.0, 1.0, out=turns)
    near, far = np.minimum(turns[0], turns[1]), np.maximum(turns[0], turns[1])
    total = np.zeros(near.size)
    for begin, end in ((0.0, near), (near, far), (far, 1.0)):
        x, y = starts + steps * ((begin + end) / 2)
        total += triangle_wave(x) * _signs(np.floor(y)) * (end - begin)
    return total * steps[1]


def _areas(sides: Floats) -> Floats:
    """Signed areas (n,)."""
    areas: Floats = sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]
    return areas


def _signs(numbers: Floats) -> Floats:
    """1 where whole numbers are even, -1 where they are odd."""
    signs: Floats = 1 - 2 * (numbers - 2 * np.floor(numbers / 2))
    return signs
