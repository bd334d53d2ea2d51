"""The pinhole camera.

A ray's direction is formed apart from the camera's position: points on the virtual screen would round
to the grid of the position and, far from the origin, fall together.
"""

import math
from dataclasses import dataclass

import numpy as np

import schemas.cameras as language
from renderer.arrays import Floats, Integers, column, cross, dot, unit

PARALLEL = 1e-9
"""Below this sine between view and up there is no usable up; float64 still gives 7 digits above it."""


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A camera without a lens.

    Attributes
    ----------
    position : (3, 1) float64
        Scene units.
    right, up, forward : (3, 1) float64
        Orthonormal to 4 eps.
    half_width, half_height : float
        Half the virtual screen's sides at distance 1.
    width, height : int
        Pixels.
    """

    position: Floats
    right: Floats
    up: Floats
    forward: Floats
    half_width: float
    half_height: float
    width: int
    height: int

    def screen(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Place on the screen at distance 1, of raster positions counted from the top left corner."""
        return (
            self.half_width * (2 * x / self.width - 1),
            self.half_height * (1 - 2 * y / self.height),
        )

    def directions(self, x: Floats, y: Floats) -> Floats:
        """Ray directions (3, N), not normalised, through raster positions (N,) and (N,)."""
        across, along = self.screen(x, y)
        return self.forward + self.right * across + self.up * along

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """Origins (3, 1) or (3, N) and directions (3, N) of samples at raster positions (N,) and (N,)."""
        del pixels, samples
        return self.position, self.directions(x, y)

    def blur(self, forward: Floats) -> Floats:
        """How far a ray may pass from the one through the middle of the lens: nothing."""
        return np.zeros_like(forward)


def basis(look: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
    """Right, up and forward, each (3, 1), from the viewing direction and a vector that is up.

    If `up` is parallel to the view, the world axis with the smallest component of the view takes its
    place. Up is derived again by a second product, which makes it perpendicular to 4 eps even where the
    first product is short.
    """
    forward = unit(look)
    right = cross(forward, unit(up))
    if math.sqrt(dot(right, right).item()) <= PARALLEL:
        axis = np.zeros((3, 1))
        axis[int(np.argmin(np.abs(forward)))] = 1.0
        right = cross(forward, axis)
    right = unit(right)
    right = unit(right - forward * dot(right, forward))
    return right, unit(cross(right, forward)), forward


def build(camera: language.Camera) -> Pinhole:
    """The camera of a scene. `focal_length` cancels: it scales the screen and its distance alike."""
    position = column(camera.position)
    right, up, forward = basis(column(camera.look_at) - position, column(camera.up))
    half_height = math.tan(math.radians(camera.vertical_fov) / 2)
    return Pinhole(
        position=position,
        right=right,
        up=up,
        forward=forward,
        half_width=half_height * (camera.width / camera.height),
        half_height=half_height,
        width=camera.width,
        height=camera.height,
    )
