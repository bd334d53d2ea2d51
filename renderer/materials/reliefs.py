"""Normals of normal maps and bump maps at many places of a pixel, in a frame of the pixel's centre."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from renderer.interaction import Points
from renderer.materials.maps import FLAT, frame_of
from renderer.math.arrays import Floats, Integers, cross, dot, unit
from renderer.textures.texels import Centers, Singles, TexelTable

Vectors = list[Singles]
"""Three components, (K, n) each."""


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """What the normals of n pixels are made of.

    Attributes
    ----------
    axes : tuple of three (3, n) float64
        Orthonormal; the third is the normal of the surface, on the viewer's side.
    centers : tuple of Centers
        Places on the relief's tables.
    scales : (S, n) float32
        Numbers that a relief needs besides.
    """

    axes: tuple[Floats, Floats, Floats]
    centers: tuple[Centers, ...]
    scales: Singles

    def part(self, index: Integers) -> "Base":
        """Those of some pixels (m,): their axes are of no more use."""
        return Base(self.axes, tuple(each.part(index) for each in self.centers), self.scales[:, index])


class Relief(Protocol):
    """What bends normals within a pixel."""

    def base(self, points: Points) -> Base:
        """What normals are made of at points with footprints."""
        ...

    def normals(self, base: Base, offsets: Singles) -> Vectors:
        """Unit normals along the axes at offsets (2, K, 1), in shares of footprints."""
        ...


@dataclass(frozen=True, slots=True)
class MappedRelief:
    """A normal map.

    Attributes
    ----------
    table : TexelTable
        Of 2 c - 1.
    """

    table: TexelTable

    def base(self, points: Points) -> Base:
        """The tangent frame and the places on the map."""
        side = np.where(points.flipped, -1.0, 1.0)
        first, second, third = (axis * side for axis in frame_of(points, np.arange(points.count)))
        centers = self.table.centers(points.coordinates, points.footprints)
        return Base((first, second, third), (centers,), np.empty((0, points.count), dtype=np.float32))

    def normals(self, base: Base, offsets: Singles) -> Vectors:
        """Filtered as stored, then normalised."""
        normals = self.table.at(base.centers[0], offsets, 3)
        squares = _dot(normals, normals)
        silent = squares < FLAT
        if silent.any():
            for part, value in zip(normals, (0, 0, 1), strict=True):
                part[silent] = value
            squares[silent] = 1
        return _scaled(normals, squares)


@dataclass(frozen=True, slots=True)
class BumpRelief:
    """A bump map.

    Attributes
    ----------
    by_u, by_v : TexelTable
        Slopes of the heights.
    """

    by_u: TexelTable
    by_v: TexelTable

    def base(self, points: Points) -> Base:
        """Axes of the tilt: the normal moves by the slopes along two vectors of the tangent plane."""
        side = np.where(points.flipped, -1.0, 1.0)
        normals = points.shading_normals * side
        by_u, by_v = np.vsplit(points.derivatives, 2)
        area = dot(cross(by_u, by_v), normals)
        sign = np.where(area < 0, -1.0, 1.0)
        tilt_u, tilt_v = sign * cross(normals, by_v), sign * cross(by_u, normals)
        first = unit(tilt_u)
        second = cross(normals, first)
        scales = np.stack((dot(tilt_u, first), dot(tilt_v, first), dot(tilt_v, second), np.abs(area)))
        scales /= np.where(scales[3] > 0, scales[3], 1.0)
        scales[:3] *= scales[3] > 0
        centers = tuple(
            each.centers(points.coordinates, points.footprints) for each in (self.by_u, self.by_v)
        )
        return Base((first * side, second * side, normals * side), centers, scales.astype(np.float32))

    def normals(self, base: Base, offsets: Singles) -> Vectors:
        """The normal of the surface moved by the heights, to first order (Blinn 1978)."""
        (slope_u,), (slope_v,) = (
            table.at(centers, offsets, 1)
            for table, centers in zip((self.by_u, self.by_v), base.centers, strict=True)
        )
        first = slope_u * base.scales[0] + slope_v * base.scales[1]
        second = slope_v * base.scales[2]
        normals = [first, second, np.ones_like(first)]
        return _scaled(normals, _dot(normals, normals))


def facing_viewer(normals: Vectors, viewers: Singles) -> tuple[Vectors, Singles]:
    """Normals, in place, and their cosines with the viewers (3, n): `maps.Horizon` for many of a pixel."""
    cosines = _dot(normals, list(viewers))
    away = np.nonzero(cosines <= 0)
    if away[0].size:
        view = viewers[:, away[1]]
        across = [part[away] - cosines[away] * v for part, v in zip(normals, view, strict=True)]
        squares = _dot(across, across)
        upright = squares == 0
        across = _scaled(across, np.where(upright, np.float32(1), squares))
        across[2][upright] = 1
        for part, values in zip(normals, across, strict=True):
            part[away] = values
        cosines[away] = 0
    return normals, cosines


def _dot(a: Vectors, b: Vectors) -> Singles:
    found = a[0] * b[0]
    found += a[1] * b[1]
    found += a[2] * b[2]
    return found


def _scaled(vectors: Vectors, squares: Singles) -> Vectors:
    """Unit vectors, in place, by their squared lengths."""
    scale = np.sqrt(squares)
    np.reciprocal(scale, out=scale)
    for part in vectors:
        np.multiply(part, scale, out=part)
    return vectors
