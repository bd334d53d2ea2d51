"""A checker board, evaluated at a point."""

from dataclasses import dataclass

import numpy as np

import schemas.textures as language
from renderer.arrays import Floats, column
from renderer.assets import AssetSource


@dataclass(frozen=True, slots=True)
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

    def at(self, coordinates: Floats) -> Floats:
        """Colours (3, N) at texture coordinates (2, N)."""
        fields = np.floor(coordinates * self.repeat)
        odd = np.mod(fields[0] + fields[1], 2.0)
        return np.where(odd == 0, self.even, self.odd)


def build(texture: language.CheckerTexture, assets: AssetSource) -> CheckerTexture:
    """The checker board of a scene."""
    del assets
    return CheckerTexture(
        column(texture.even), column(texture.odd), np.array(texture.repeat, dtype=np.float64)[:, None]
    )
