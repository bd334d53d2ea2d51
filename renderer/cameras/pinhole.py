"""The pinhole camera.

A ray's direction is formed apart from the camera's position: points on the virtual screen would round
to the grid of the position and, far from the origin, fall together.
"""

import math
from dataclasses import dataclass

import numpy as np

import schemas.cameras as language
from renderer.math.arrays import Floats, Integers, column, cross, dot, unit
from schemas.vectors import difference, parallel


@dataclass(frozen=True, slots=True, eq=False)
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
        """Place on the screen at distance 1, of raster positions counted from the top left corner.

        The middle is subtracted before the division, while all numbers are multiples of the same step:
        places opposite each other differ in their sign alone.
        """
        return (
            self.half_width * ((2 * x - self.width) / self.width),
            self.half_height * ((self.height - 2 * y) / self.height),
        )

    def bounds(self, x0: int, y0: int, x1: int, y1: int) -> Floats:
        """Least and greatest place on the screen of a rectangle of the raster, across and along, (4,)."""
        return np.concatenate(self.screen(np.array([x0, x1]), np.array([y1, y0])))

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
    """Right, up and forward, each (3, 1), from the viewing direction and a vector that is up, of any lengths.

    Orthonormal to 4 eps even where the first product is short: right is made perpendicular once more, and
    up is derived again. Both are off by at most 5 eps over the sine of the angle between view and up.
    """
    forward = unit(look)
    right = unit(cross(forward, unit(up)))
    right = unit(right - forward * dot(right, forward))
    return right, unit(cross(right, forward)), forward


def upward(camera: language.Camera) -> Floats:
    """What is up, (3, 1): the camera's vector, or where it is parallel to the view another.

    That is the world axis with the smallest component of the view.
    """
    look = difference(camera.look_at, camera.position)
    if not parallel(look, camera.up):
        return column(camera.up)
    axis = np.zeros((3, 1))
    axis[int(np.argmin(np.abs(look)))] = 1.0
    return axis


def build(camera: language.Camera) -> Pinhole:
    """The camera of a scene. `focal_length` cancels: it scales the screen and its distance alike."""
    position = column(camera.position)
    right, up, forward = basis(column(camera.look_at) - position, upward(camera))
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
