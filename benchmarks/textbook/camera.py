"""The pinhole camera of the textbooks: places of a virtual screen in the world, seen from the eye."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from benchmarks.textbook.single import SINGLE, Singles, normalised
from renderer.cameras import Pinhole

if TYPE_CHECKING:
    from renderer.math.arrays import Floats, Integers


@dataclass(frozen=True, slots=True, eq=False)
class TextbookCamera(Pinhole):
    """A pinhole camera whose vectors are float32."""

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Singles, Singles]:
        """Origin (3, 1) and unit directions (3, N) through raster positions (N,) and (N,)."""
        del pixels, samples
        across = (2 * x.astype(SINGLE) / self.width - 1) * self.half_width
        along = (1 - 2 * y.astype(SINGLE) / self.height) * self.half_height
        places = self.position + self.forward + self.right * across + self.up * along
        return self.position, normalised(places - self.position)
