"""Textures: values that vary over a surface."""

from typing import Protocol

from renderer.math.arrays import Floats


class Texture(Protocol):
    """A function of texture coordinates."""

    def at(self, coordinates: Floats, footprints: Floats | None = None) -> Floats:
        """Values (3, N) float64 at texture coordinates (2, N).

        Textures that filter take the mean over footprints, d(u, v) by d(x, y) of the sample, (2, 2, N).
        """
        ...
