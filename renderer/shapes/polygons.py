"""Planar convex shapes: families of them, and their occluders."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, taken
from renderer.math.numerics import PLANE_ERROR
from renderer.shapes.family import Family


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """K planar convex polygons with E edges each.

    A point x of the plane is inside where `edge_normals . (x - edge_anchors) >= 0` for every edge.

    Attributes
    ----------
    numbers, primitives : (K,) int64
        Numbers of the shapes in the scene, and within each of these.
    sizes : (K,) float64
        Sum of magnitudes of the coordinates, scene units.
    normals, anchors : (3, K) float64
        Unit normal, and a point of the plane.
    edge_normals, edge_anchors : (E, 3, K) float64
        Inward normals in the plane, and a point of each edge.
    corners : (V, 3, K) float64
    """

    numbers: Integers
    primitives: Integers
    sizes: Floats
    normals: Floats
    anchors: Floats
    edge_normals: Floats
    edge_anchors: Floats
    corners: Floats


@dataclass(slots=True, eq=False)
class FlatFamily(Family):
    """A family whose primitives are planar convex polygons.

    Attributes
    ----------
    normals : (3, K) float64
        Outward unit normals; zero for primitives without area.
    """

    normals: Floats

    @abstractmethod
    def occluders(self) -> Polygons:
        """The same primitives as occluders."""

    @property
    def surface(self) -> str:
        """A plane."""
        return "plane"

    def reaches(self) -> Floats:
        """None if a coordinate is the same at all corners: no extent, however large, rounds that."""
        return _reaches(self.corners(), self.sizes)

    def signatures(self, origin: Floats, direction: Floats, reach: float) -> tuple[Floats, Floats]:
        """By the foot of the perpendicular from the origin on the plane.

        Of two shapes in one plane the corners of one are near the plane of the other, so that their normals
        differ by twice that room over the height of the former, and their feet by the distance times that.
        All roundings together are below 64.
        """
        a, b, c = corners = self.corners()[:3] - origin
        longest = np.max([lengths(b - a), lengths(c - b), lengths(a - c)], axis=0)
        distance = np.max([lengths(corner) for corner in corners], axis=0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            tilt = np.nan_to_num(distance / (lengths(cross(b - a, c - a)) / longest), nan=np.inf)
            room = 64 * PLANE_ERROR * (reach + self.sizes) * (1 + tilt)
        foot = dot(self.normals, a) * dot(self.normals, direction)
        return foot, np.where(self.without_area(), np.nan, room)

    def coincide(self, own: Integers, other: Family, others: Integers) -> Masks:
        """Whether they lie in one plane and overlap by more than rounding.

        Polygons that only share an edge or a corner do not overlap: some edge of one of the two has all of
        the other on its outside (Gottschalk, Lin and Manocha 1996, in the plane).
        """
        assert isinstance(other, FlatFamily), "only what lies on a plane is compared with flat shapes"
        together = np.flatnonzero(_in_plane(self, own, other, others) | _in_plane(other, others, self, own))
        some, rest = self.part(own[together]), other.part(others[together])
        a, b, room = some.occluders(), rest.occluders(), PLANE_ERROR * (some.sizes + rest.sizes)
        result = np.zeros(own.size, dtype=bool)
        result[together] = ~(_beside(a, b, room) | _beside(b, a, room))
        return result

    def shades_itself(self, viewer: Floats | None) -> bool:
        """Never: what is flat shows light and viewer the same side of it, or is dark."""
        del viewer
        return False


def _reaches(corners: Floats, sizes: Floats) -> Floats:
    return np.where((corners == corners[0]).all(axis=0).any(axis=0), 0.0, sizes)


def _in_plane(a: FlatFamily, own: Integers, b: FlatFamily, others: Integers) -> Masks:
    """Whether primitives of b lie in the planes of primitives of a, (P,) each.

    A plane is known to the rounding of its corners, but one along two axes, to that of what lies in it.
    """
    normal, corners, other_corners = (
        taken(a.normals, own),
        taken(a.corners(), own),
        taken(b.corners(), others),
    )
    sizes, other_sizes = a.sizes[own], b.sizes[others]
    least = np.minimum(sizes, other_sizes)
    reach = np.maximum(_reaches(corners, sizes), least)
    room = PLANE_ERROR * (reach + np.maximum(_reaches(other_corners, other_sizes), least))
    heights = np.stack([dot(normal, corner - corners[0]) for corner in other_corners])
    return np.asarray((np.abs(heights) <= room).all(axis=0))


def _beside(a: Polygons, b: Polygons, room: Floats) -> Masks:
    """Whether an edge of polygons a (P,) has all corners of b on its outside, or less than `room` inside."""
    beside = np.zeros(room.size, dtype=bool)
    for normals, anchors in zip(a.edge_normals, a.edge_anchors, strict=True):
        depths = np.stack([dot(normals, corner - anchors) for corner in b.corners])
        beside |= depths.max(axis=0) <= room
    return beside
