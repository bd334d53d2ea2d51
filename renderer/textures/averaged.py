"""The mean of a texture over a pixel, from its values in the pixel's parts."""

from dataclasses import dataclass

import numpy as np

from renderer.arrays import Floats
from renderer.textures.sampling import Texture


@dataclass(frozen=True, slots=True)
class AveragedTexture:
    """A texture looked up in the middles of n x n parts of its footprint, each filtered as a part of it.

    Attributes
    ----------
    texture : Texture
    parts : int
        Along each side.
    """

    texture: Texture
    parts: int

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Mean values (3, N) around texture coordinates (2, N)."""
        if footprints is None:
            return self.texture.at(coordinates)
        smaller = footprints / self.parts
        steps = np.arange(self.parts) - (self.parts - 1) / 2
        total = np.zeros((3, coordinates.shape[1]))
        for across in steps.tolist():
            for along in steps.tolist():
                middles = coordinates + across * smaller[:, 0] + along * smaller[:, 1]
                total += self.texture.at(middles, smaller)
        return total / self.parts**2
