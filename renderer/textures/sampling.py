"""What a texture can do."""

from typing import Protocol

from renderer.arrays import Floats


class Texture(Protocol):
    """A function of texture coordinates."""

    def at(self, coordinates: Floats) -> Floats:
        """Values (3, N) float64 at texture coordinates (2, N)."""
        ...
