"""Cameras, which map points of the picture to rays: pinhole, thin lens, and crops of both.

A ray's direction is computed without the camera's position: far from the origin, points on the virtual screen
would be rounded to the grid of the position, and coincide.

A lens blurs everything nearer or farther than the focus. All rays of a place on the picture pass
through one point of the plane in focus. A point at depth z (along the view) spreads over a circle of diameter
2 R |1 / F - 1 / z| on the screen at distance 1, R the radius of the lens and F the distance of the plane in
focus (Potmesil, Chakravarty 1981).
"""

import math
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

import schemas.cameras as language
from renderer.math.arrays import Floats, Integers, column, cross, dot, lengths, magnitude, unit
from renderer.math.numerics import EPS
from renderer.math.streams import Keys, bits, keys
from renderer.samplers import PATTERNS, scrambled
from schemas.quality import Antialiasing
from schemas.quantities import difference, parallel


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

    def numbers(self, columns: Integers, rows: Integers) -> Integers:
        """Numbers of pixels (N,), on which their random numbers depend."""
        return rows * self.width + columns

    def blur(self, forward: Floats) -> Floats:
        """Distance of rays from the one through the centre of the lens: 0."""
        return np.zeros_like(forward)


def basis(view: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
    """Right, up and forward, each (3, 1), from the viewing direction and a vector that is up, of any lengths.

    Orthonormal to 4 eps even where the first product is short: right is made perpendicular once more, and
    up is derived again. Both are off by at most 5 eps over the sine of the angle between view and up.
    """
    forward = unit(view)
    right = unit(cross(forward, unit(up)))
    # The direction of a short product is mostly rounding, so its part along the view is removed once more.
    right = unit(right - forward * dot(right, forward))
    return right, unit(cross(right, forward)), forward


def upward(camera: language.Camera) -> Floats:
    """Up vector, (3, 1): the camera's, or another one if that is parallel to the view.

    That is the world axis with the smallest component of the view.
    """
    view = difference(camera.look_at, camera.position)
    if not parallel(view, camera.up):
        return column(camera.up)
    axis = np.zeros((3, 1))
    axis[int(np.argmin(np.abs(view)))] = 1.0
    return axis


def build_pinhole(camera: language.Camera) -> Pinhole:
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


LENS_DIMENSIONS = 1 << 40
"""Stream of the places on the lens, beyond the numbers of all lights."""

BLUR_MARGIN = 2.0**-40
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

        The pattern `random` has random ones. All others have Owen-scrambled Sobol points, as many as camera
        samples, in a different order in each pixel, so that positions in the pixel and on the lens are
        uncorrelated.
        """
        key = keys(self.seed, LENS_DIMENSIONS, pixels)
        if self.antialiasing.pattern == "random":
            return disk(*PATTERNS["random"](key, samples, self.antialiasing.samples))
        return disk(*PATTERNS["sobol"](key, shuffled(key, samples), self.antialiasing.samples))

    def blur(self, forward: Floats) -> Floats:
        """Greatest distance of a ray from the pinhole's at some depth, rounding included.

        Convex in the depth, so that it holds between corners if it holds at them.
        """
        depth = forward / self.focus
        rounding = BLUR_MARGIN * (1 + np.abs(depth)) * self.radius + 4 * EPS * magnitude(self.position).item()
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


def build_lens(camera: language.Camera, antialiasing: Antialiasing, seed: int) -> ThinLens:
    """The camera of a scene that asks for a lens; focused on `look_at` unless it says where."""
    hole = build_pinhole(camera)
    away = lengths(column(camera.look_at) - hole.position).item()
    return ThinLens(
        **{item.name: getattr(hole, item.name) for item in fields(hole)},
        radius=camera.lens_radius,
        focus=away if camera.focus_distance is None else camera.focus_distance,
        antialiasing=antialiasing,
        seed=seed,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Window(Pinhole):
    """A camera whose raster is a rectangle of another camera's raster; its pixels are the same.

    Attributes
    ----------
    whole : Pinhole
        The camera of the whole picture, with or without a lens.
    left, top : int
        Column and row of the upper left pixel.
    """

    whole: Pinhole
    left: int
    top: int

    @classmethod
    def of(cls, whole: Pinhole, crop: tuple[int, int, int, int]) -> Self:
        """The camera of a part of a picture, `x, y, width, height`, which must be inside it."""
        left, top, width, height = crop
        view = (whole.position, whole.right, whole.up, whole.forward, whole.half_width, whole.half_height)
        return cls(*view, width=width, height=height, whole=whole, left=left, top=top)

    def screen(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Place on the screen of the whole camera, of raster positions of this one."""
        return self.whole.screen(x + self.left, y + self.top)

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """As of the whole camera, at raster positions of this one."""
        return self.whole.rays(x + self.left, y + self.top, pixels, samples)

    def numbers(self, columns: Integers, rows: Integers) -> Integers:
        """As of the whole camera, of pixels of this one."""
        return self.whole.numbers(columns + self.left, rows + self.top)

    def blur(self, forward: Floats) -> Floats:
        """As of the whole camera."""
        return self.whole.blur(forward)

    def places(self, pixels: Integers) -> Integers:
        """Pixels (2 or more, N) of the whole picture that lie in this one, in its coordinates."""
        columns, rows = pixels[0] - self.left, pixels[1] - self.top
        inside = (columns >= 0) & (columns < self.width) & (rows >= 0) & (rows < self.height)
        return np.stack([columns, rows, *pixels[2:]])[:, inside]
