"""Visible lights in pixels: areas of their clipped outlines, with rays for the occluded share alone.

A lamp that covers a thousandth of a pixel and is a thousand times as bright as white makes it white, and few
rays would hit it.
"""

from dataclasses import dataclass

import numpy as np

from renderer.adaptive.labels import Labels, of_lights
from renderer.cameras import Pinhole
from renderer.interaction import EMITTER
from renderer.lights.surfaces import LightSurfaces
from renderer.math.arrays import Floats, Integers, Masks, dot
from renderer.shapes.rectangles import Rectangles


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Clipped parts of m light outlines within pixels, occluders ignored.

    Attributes
    ----------
    pixels : (m,) int64
        Indices of the pixels.
    lights : (m,) int64
        Numbers of the lights.
    corners : (m, V, 2) float64
        Of convex polygons: across and along, from 0 to 1 in the pixel. Corners may be repeated.
    """

    pixels: Integers
    lights: Integers
    corners: Floats

    def areas(self) -> Floats:
        """Share of the pixel that each covers, (m,)."""
        return self._triangles().sum(axis=1)

    def places(self, across: Floats, along: Floats) -> Floats:
        """Map points of the unit square, (m, k) each, onto the polygons, (2, m, k), preserving areas."""
        areas = np.cumsum(self._triangles(), axis=1)
        wanted = across * areas[:, -1:]
        which = np.minimum((wanted[:, :, None] >= areas[:, None]).sum(axis=2), areas.shape[1] - 1)
        above = np.take_along_axis(areas, which, axis=1)
        below = np.take_along_axis(np.pad(areas, ((0, 0), (1, 0))), which, axis=1)
        inside = np.sqrt(np.clip((wanted - below) / (above - below), 0, 1))[..., None]
        rows = np.arange(len(areas))[:, None]
        first, second = self.corners[rows, which + 1], self.corners[rows, which + 2]
        start = self.corners[:, :1]
        return np.moveaxis(start + inside * (first - start + along[..., None] * (second - first)), 2, 0)

    def _triangles(self) -> Floats:
        """Areas (m, V - 2) of the triangle fan from the first corner."""
        away = self.corners[:, 1:] - self.corners[:, :1]
        (x, y), (next_x, next_y) = (np.moveaxis(ends, 2, 0) for ends in (away[:, :-1], away[:, 1:]))
        return np.abs(x * next_y - y * next_x) / 2


def lit(labels: Labels, edges: Integers) -> Masks:
    """Pixels (H, W) whose pilot sample hit a light, or that `edges` (2, N) of lights cross."""
    found = of_lights(labels)
    columns, rows = edges
    found[rows, columns] = True
    return found


def pieces_of(
    camera: Pinhole, visible: tuple[LightSurfaces, ...], columns: Integers, rows: Integers
) -> Pieces:
    """Clip the outlines of lights to pixels (n,)."""
    found = [Pieces(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 8, 2)))]
    for lights in visible:
        found += [
            _pieces(camera, lights.rectangles, light, columns, rows)
            for light in range(lights.rectangles.numbers.size)
        ]
    pixels, numbers, corners = zip(*((each.pixels, each.lights, each.corners) for each in found), strict=True)
    return Pieces(np.concatenate(pixels), np.concatenate(numbers), np.concatenate(corners))


def _pieces(camera: Pinhole, lights: Rectangles, light: int, columns: Integers, rows: Integers) -> Pieces:
    outline = _seen_from(camera, lights, light)
    # By quarters of a pixel: the camera of a part of a picture accepts only positions inside its pixels.
    left, top = camera.screen(np.float64(0.25) + columns, np.float64(0.25) + rows)
    right, bottom = camera.screen(np.float64(0.75) + columns, np.float64(0.75) + rows)
    middle, size = np.stack((left + right, top + bottom)) / 2, 2 * np.stack((right - left, bottom - top))
    depth = np.broadcast_to(outline[2][:, None], (4, columns.size))
    places = (outline[:2, :, None] - middle[:, None] * depth) / size[:, None]
    sides = np.concatenate((depth / 2 + places, depth / 2 - places))
    near = np.flatnonzero((sides >= 0).any(axis=1).all(axis=0))
    polygons = np.stack((*places[:, :, near], depth[:, near])).transpose(2, 1, 0)
    for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)):
        polygons = _cut(polygons, polygons[:, :, 2] / 2 + sign * polygons[:, :, axis])
    flat = np.divide(
        polygons[:, :, :2],
        polygons[:, :, 2:],
        out=np.zeros((*polygons.shape[:2], 2)),
        where=polygons[:, :, 2:] > 0,
    )
    pieces = Pieces(near, np.full(near.size, lights.numbers[light] - EMITTER), flat + 0.5)
    some = np.flatnonzero(pieces.areas())
    return Pieces(near[some], pieces.lights[some], pieces.corners[some])


def _seen_from(camera: Pinhole, lights: Rectangles, light: int) -> Floats:
    """Corners around a light, (3, 4): right, up and forward from the camera."""
    first, second = lights.first[:, light, None], lights.second[:, light, None]
    away = lights.anchors[:, light, None] - camera.position
    corners = np.hstack((away, away + first, away + first + second, away + second))
    return np.stack([dot(corners, axis) for axis in (camera.right, camera.up, camera.forward)])


def _cut(polygons: Floats, inside: Floats) -> Floats:
    """Clip convex polygons (m, V, 3) to where a linear function is not negative: (m, V + 1, 3).

    `inside` (m, V) are its values at the corners. All corners of empty polygons coincide.
    """
    following = np.roll(inside, -1, axis=1)
    kept = inside >= 0
    crossing = kept != (following >= 0)
    share = np.divide(inside, inside - following, out=np.zeros_like(inside), where=crossing)
    between = polygons + share[:, :, None] * (np.roll(polygons, -1, axis=1) - polygons)
    count = polygons.shape[1]
    both = np.stack((polygons, between), axis=2).reshape(len(polygons), 2 * count, 3)
    valid = np.stack((kept, crossing), axis=2).reshape(len(polygons), 2 * count)
    order = np.argsort(~valid, axis=1, kind="stable")[:, : count + 1]
    there: Masks = np.take_along_axis(valid, order, axis=1)
    found = np.take_along_axis(both, order[:, :, None], axis=1)
    return np.where(there[:, :, None], found, found[:, :1])
