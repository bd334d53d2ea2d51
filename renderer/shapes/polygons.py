"""Planar convex shapes: the families made of them, and what they are as occluders."""

from abc import abstractmethod
from dataclasses import dataclass

from renderer.math.arrays import Floats, Integers
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
        """The same primitives as things that stand in the light."""

    def shades_itself(self, viewer: Floats | None) -> bool:
        """Never: what is flat shows light and viewer the same side of it, or is dark."""
        del viewer
        return False
