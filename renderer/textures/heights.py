"""Heights from textures."""

from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats
from renderer.textures.image import ImageTexture
from renderer.textures.mipmap import MipmapTexture

LOOKUPS_A_SLOPE = 4
"""Look-ups in the texture for the slopes at one place."""


@dataclass(frozen=True, slots=True)
class Heights:
    """A texture read as heights: the mean of its three values, as stored, times a scale.

    Attributes
    ----------
    texture : ImageTexture
        Decoded as stored, 0..1.
    scale : float
        Height of the value 1, scene units.
    """

    texture: ImageTexture
    scale: float

    def at(self, coordinates: Floats) -> Floats:
        """Heights (N,) at texture coordinates (2, N), scene units."""
        values = self.texture.at(coordinates)
        return self.scale * ((values[0] + values[1] + values[2]) / 3)

    def slopes(self, coordinates: Floats) -> tuple[Floats, Floats]:
        """Derivatives by u and by v, (N,) each: differences over one texel about the place."""
        height, width = self.texture.texels.shape[:2]
        across, along = np.array([[0.5 / width], [0.0]]), np.array([[0.0], [0.5 / height]])
        by_u = (self.at(coordinates + across) - self.at(coordinates - across)) * width
        by_v = (self.at(coordinates + along) - self.at(coordinates - along)) * height
        return by_u, by_v


def image_of(texture: ImageTexture | MipmapTexture) -> ImageTexture:
    """The image that a texture's heights are read from: of a pyramid the image itself."""
    return texture.levels[0] if isinstance(texture, MipmapTexture) else texture
