"""A checker board: its value at a point, and its exact mean over a box or over a pixel.

The board is a product of two square waves s(x) s(y). With the triangle wave T, whose derivative is s, Green's
theorem makes its integral over a footprint that of T(x) s(y) dy around it. Between the places where an edge
passes a whole x or y, the integrand is linear, so that its value in the middle gives the integral.
"""

from dataclasses import dataclass

import numpy as np

import schemas.textures as language
from renderer.assets import AssetSource
from renderer.math.arrays import Floats, column, taken


@dataclass(frozen=True, slots=True, eq=False)
class CheckerTexture:
    """Two colours that alternate.

    Attributes
    ----------
    even, odd : (3, 1) float64
        Linear; `even` holds texture coordinates (0, 0).
    repeat : (2, 1) float64
        Fields along u and v over 0..1.
    """

    even: Floats
    odd: Floats
    repeat: Floats

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Colours (3, N) at texture coordinates (2, N)."""
        del footprints
        fields = np.floor(coordinates * self.repeat)
        odd = np.mod(fields[0] + fields[1], 2.0)
        return np.where(odd == 0, self.even, self.odd)


@dataclass(frozen=True, slots=True)
class BoxCheckerTexture:
    """The exact mean of a checker board over a box in texture space.

    The box has sides along u and v and goes around the footprint, which is a parallelogram. Over a box the
    board is a product of two square waves, +1 and -1 alternating, and so is its mean.

    Attributes
    ----------
    board : CheckerTexture
    """

    board: CheckerTexture

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Mean colours (3, N) around texture coordinates (2, N)."""
        if footprints is None:
            return self.board.at(coordinates)
        repeat = self.board.repeat
        return self.mixed(self.waves(coordinates * repeat, footprints * repeat[:, None]))

    def waves(self, centers: Floats, sides: Floats) -> Floats:
        """Mean of the board's wave (N,) over the boxes around footprints, in fields."""
        across, along = mean_square_wave(centers, np.abs(sides[:, 0]) + np.abs(sides[:, 1]))
        product: Floats = across * along
        return product

    def mixed(self, waves: Floats) -> Floats:
        """Colours (3, N) where the board's wave, +1 on even fields and -1 on odd ones, has means (N,)."""
        odd = (1 - waves) / 2
        return self.board.even + odd * (self.board.odd - self.board.even)


MIN_BOX_SHARE = 2.0**-26
"""Boxes narrower than this share of a field count as points: the difference of two integrals loses its
digits."""


def mean_square_wave(centers: Floats, widths: Floats) -> Floats:
    """Mean over intervals of the wave that is +1 on [0, 1), -1 on [1, 2) and so on.

    Its integral is a triangle wave. The centres are reduced to one period first.

    Parameters
    ----------
    centers, widths : float64 arrays of the same shape
        In fields.

    Returns
    -------
    array of float64
        Between -1 and 1; error at most some eps / min(width, 1).
    """
    centers = np.mod(centers, 2.0)
    point = np.where(centers < 1, 1.0, -1.0)
    wide = widths >= MIN_BOX_SHARE
    safe = np.where(wide, widths, 1.0)
    integral = triangle_wave(centers + safe / 2) - triangle_wave(centers - safe / 2)
    return np.where(wide, np.clip(integral / safe, -1.0, 1.0), point)


def triangle_wave(x: Floats) -> Floats:
    """The integral of the square wave from 0 on: up to 1 at odd numbers, down to 0 at even ones."""
    wave: Floats = np.abs(x - 2 * np.rint(x / 2))
    return wave


def build(texture: language.CheckerTexture, assets: AssetSource) -> CheckerTexture | BoxCheckerTexture:
    """The checker board of a scene."""
    del assets
    board = CheckerTexture(
        column(texture.even), column(texture.odd), np.array(texture.repeat, dtype=np.float64)[:, None]
    )
    return BoxCheckerTexture(board) if texture.filter == "box" else board


MAX_FIELDS = 64.0
"""Largest side of a footprint, fields. Beyond, the mean over its box is as good: both are within a hundredth
of the mean colour."""

MIN_AREA_SHARE = 2.0**-20
"""Footprints whose area is a smaller share of the square on their longer side count as boxes: the area
between such close edges loses its digits."""


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
        several = np.flatnonzero((first[0] != last[0]) | (first[1] != last[1]))
        waves[several] = self._means(taken(centers, several), taken(sides, several))
        return self.board.mixed(waves)

    def _means(self, centers: Floats, sides: Floats) -> Floats:
        """Mean waves (n,) over footprints that reach into more than one field."""
        longest = np.abs(sides).max(axis=(0, 1))
        areas = np.abs(_areas(np.clip(sides, -MAX_FIELDS, MAX_FIELDS)))
        usable = (longest <= MAX_FIELDS) & (areas > MIN_AREA_SHARE * np.minimum(longest, MAX_FIELDS) ** 2)
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
