"""Texture footprints of samples: ray differentials (Igehy 1999).

A sample covers its share of the pixel, 1 / sqrt(samples) of each side. The footprint is the offset, in u and
v, at which rays offset by that share hit the tangent plane of the point. Only filtering textures need it.
"""

from dataclasses import dataclass

import numpy as np

from renderer.cameras import Pinhole
from renderer.interaction import Points
from renderer.math.arrays import Floats, cross, dot, lengths, unit
from renderer.shapes.frames import frame_of_normals

MIN_COSINE = 2.0**-40
"""Least cosine between ray and normal: footprints are long at the horizon, and finite."""


@dataclass(frozen=True, slots=True, eq=False)
class Footprints:
    """Stage: derivatives of texture coordinates by a sample's share of the pixel.

    Camera rays are offset across and along the picture. Rays that have bounced take a round estimate instead:
    a cone as wide as a share in the middle of the picture, after the whole length of the path. It ignores
    curvature, so what a curved mirror enlarges or shrinks is filtered as if it were flat.

    Attributes
    ----------
    across, along : (3, 1) float64
        Change of a camera ray's direction across a share of a pixel.
    """

    across: Floats
    along: Floats

    def run(self, points: Points) -> None:
        """Give the points their footprints."""
        seen = points.paths == 0
        width = np.sqrt(lengths(self.across) * lengths(self.along))
        size = width * (points.path_lengths + points.t * lengths(points.directions))
        beside = frame_of_normals(points.viewers)
        above = cross(points.viewers, beside)
        offsets = (
            np.where(seen, points.t * self.across, size * beside),
            np.where(seen, points.t * self.along, size * above),
        )
        points.footprints = np.stack(
            [_in_texture(points, _on_plane(points, part)) for part in offsets], axis=1
        )


def _on_plane(points: Points, offsets: Floats) -> Floats:
    """Offsets (3, M) of places on rays, moved along the rays to the tangent planes."""
    cosines = np.maximum(dot(points.normals, points.viewers), MIN_COSINE)
    return offsets + points.viewers * (-dot(points.normals, offsets) / cosines)


def _in_texture(points: Points, offsets: Floats) -> Floats:
    """Offsets (3, M) within tangent planes as offsets of texture coordinates (2, M), by the dual basis.

    Where texture coordinates do not span the surface, as at a pole, they are 0.
    """
    by_u, by_v = np.vsplit(points.derivatives, 2)
    first, second = unit(by_u), unit(by_v)
    normals = cross(first, second)
    squares = dot(normals, normals)
    parts = []
    for vectors, scale in ((cross(second, normals), by_u), (cross(normals, first), by_v)):
        divisor = squares * lengths(scale)
        usable = divisor > 0
        parts.append(np.where(usable, dot(vectors, offsets) / np.where(usable, divisor, 1.0), 0.0))
    return np.stack(parts)


def build(camera: Pinhole, samples: int) -> Footprints:
    """The stage for a camera with this number of rays per pixel."""
    share = 1 / np.sqrt(samples)
    return Footprints(
        across=camera.right * (2 * camera.half_width / camera.width * share),
        along=camera.up * (-2 * camera.half_height / camera.height * share),
    )
