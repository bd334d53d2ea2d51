"""Lights visible to the camera."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import EMITTER, Rays
from renderer.lights.emitters import Emitter
from renderer.math.arrays import Floats, Integers, columns
from renderer.shapes.rectangles import Rectangles, from_edges

TIE_DISTANCE = 2.0**-40
"""A light this close behind a shape, relative to the distance, lies in it and is seen.

Thousands of roundings wide, and far below a pixel.
"""


@dataclass(frozen=True, slots=True)
class LightSurfaces:
    """Stage: rays that hit visible lights.

    Attributes
    ----------
    rectangles : Rectangles
        The lights as shapes, with numbers from `EMITTER` on.
    """

    rectangles: Rectangles

    def run(self, rays: Rays) -> None:
        """Let lights take the rays that hit nothing nearer."""
        behind = rays.anew()
        for light in range(self.rectangles.numbers.size):
            self.rectangles.intersect(light, behind)
        seen = np.flatnonzero(np.isfinite(behind.t) & (behind.t <= rays.t * (1 + TIE_DISTANCE)))
        rays.t[seen] = behind.t[seen]
        rays.shapes[seen] = behind.shapes[seen]


def build(emitters: list[Emitter]) -> LightSurfaces:
    """The surfaces of some rectangle lights."""
    first, second, centre = (
        np.hstack([getattr(emitter, name) for emitter in emitters]) for name in ("first", "second", "centre")
    )
    numbers = np.array([EMITTER + emitter.number for emitter in emitters], dtype=np.int64)
    return LightSurfaces(from_edges(numbers, centre - first / 2 - second / 2, first, second))


@dataclass(frozen=True, slots=True, eq=False)
class Unshaded:
    """Radiance of rays that hit no shape.

    Attributes
    ----------
    background : (3, 1) float64
    lights : (3, lights of the scene) float64
        Flat colours.
    """

    background: Floats
    lights: Floats

    def radiance(self, shapes: Integers) -> Floats:
        """Colours (3, N) by shape numbers (N,), the background for misses; shapes' own rays are set later."""
        table = np.hstack((self.background, self.lights))
        return table[:, np.where(shapes >= EMITTER, shapes - EMITTER + 1, 0)]


def colors(lights: list[tuple[float, float, float]]) -> Floats:
    """Flat colours (3, K) of all lights of a scene."""
    return columns(lights) if lights else np.zeros((3, 0))
