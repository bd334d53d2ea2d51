"""A checker board, evaluated at a point or as its mean over a box."""

from dataclasses import dataclass

import numpy as np

import schemas.textures as language
from renderer.assets import AssetSource
from renderer.math.arrays import Floats, column


@dataclass(frozen=True, slots=True, eq=False)
class CheckerTexture:
    """Two colours in turns.

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
    board is a product of two square waves, +1 and -1 in turns, and so is its mean.

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


NARROW = 2.0**-26
"""Boxes narrower than this share of a field are points: a difference of two integrals has few digits left."""


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
    wide = widths >= NARROW
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
