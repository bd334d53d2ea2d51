"""The camera with a thin lens: what is nearer or farther than the focus is blurred.

All rays of a place on the picture meet in one point of the plane in focus. A point at depth z (along the
view) spreads over a circle of diameter 2 R |1 / F - 1 / z| on the screen at distance 1, R the radius of the
lens and F the distance of the plane in focus (Potmesil, Chakravarty 1981).
"""

from dataclasses import dataclass

import numpy as np

import schemas.cameras as language
from renderer.cameras import pinhole
from renderer.cameras.pinhole import Pinhole
from renderer.math.arrays import Floats, Integers, column, lengths, magnitude
from renderer.math.numerics import EPS
from renderer.math.streams import Keys, bits, keys
from renderer.samplers import PATTERNS
from renderer.samplers.sobol import scrambled
from schemas.sampling import Antialiasing

LENS_DIMENSIONS = 1 << 40
"""Stream of the places on the lens, beyond the numbers of all lights."""

ROUNDING = 2.0**-40
"""Relative margin of the blur, thousands of roundings wide."""


@dataclass(frozen=True, slots=True, eq=False)
class ThinLens(Pinhole):
    """A camera with a lens around `position`, perpendicular to the view.

    Attributes
    ----------
    radius, focus : float
        Of the lens, and of the plane in focus from it along the view; scene units.
    antialiasing : Antialiasing
        One place on the lens a camera sample.
    seed : int
    """

    radius: float
    focus: float
    antialiasing: Antialiasing
    seed: int

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """Origins on the lens and directions to the points in focus, (3, N) each.

        The direction is the pinhole's minus the place on the lens in units of the focus: no difference of
        points far from the world's origin.
        """
        a, b = self.places(pixels, samples)
        offsets = self.radius * (self.right * a + self.up * b)
        bend = self.radius / self.focus
        turned = self.right * (bend * a) + self.up * (bend * b)
        return self.position + offsets, self.directions(x, y) - turned

    def places(self, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """Places on the lens of radius 1, (N,) and (N,).

        The pattern `random` takes random ones. All others take Owen-scrambled Sobol points, as many as camera
        samples, in an order of their own in each pixel, so that no place in the pixel goes with a place on
        the lens.
        """
        key = keys(self.seed, LENS_DIMENSIONS, pixels)
        if self.antialiasing.pattern == "random":
            return disk(*PATTERNS["random"](key, samples, self.antialiasing.samples))
        return disk(*PATTERNS["sobol"](key, shuffled(key, samples), self.antialiasing.samples))

    def blur(self, forward: Floats) -> Floats:
        """How far a ray may pass from the pinhole's at some depth, rounding included.

        Convex in the depth, so that it holds between corners if it holds at them.
        """
        depth = forward / self.focus
        rounding = ROUNDING * (1 + np.abs(depth)) * self.radius + 4 * EPS * magnitude(self.position).item()
        return self.radius * np.abs(1 - depth) + rounding


def shuffled(key: Keys, index: Integers) -> Integers:
    """Sample numbers in another order (Burley 2020): blocks of a power of two stay together."""
    order = scrambled(np.asarray(index).astype(np.uint32), bits(key, 2))
    return order.astype(np.int64)


def disk(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The unit square onto the unit disk, area to area, neighbours to neighbours (Shirley, Chiu 1997)."""
    x, y = 2 * a - 1, 2 * b - 1
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    other = np.where(wide, y, x)
    slope = np.divide(other, radius, out=np.zeros_like(other), where=radius != 0)
    turn = np.pi / 4 * slope
    near, far = radius * np.cos(turn), radius * np.sin(turn)
    return np.where(wide, near, far), np.where(wide, far, near)


def build(camera: language.Camera, antialiasing: Antialiasing, seed: int) -> ThinLens:
    """The camera of a scene that asks for a lens; focused on `look_at` unless it says where."""
    hole = pinhole.build(camera)
    away = lengths(column(camera.look_at) - hole.position).item()
    return ThinLens(
        position=hole.position,
        right=hole.right,
        up=hole.up,
        forward=hole.forward,
        half_width=hole.half_width,
        half_height=hole.half_height,
        width=hole.width,
        height=hole.height,
        radius=camera.lens_radius,
        focus=away if camera.focus_distance is None else camera.focus_distance,
        antialiasing=antialiasing,
        seed=seed,
    )
