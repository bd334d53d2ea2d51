"""Planar convex shapes as occluders: a plane, and one edge function a side."""

from dataclasses import dataclass

from renderer.math.arrays import Floats, Integers


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """K planar convex polygons with E edges each.

    A point x of the plane is inside where `edge_normals . (x - edge_anchors) >= 0` for every edge.

    Attributes
    ----------
    numbers : (K,) int64
        Numbers of the shapes in the scene.
    sizes : (K,) float64
        Sum of magnitudes of the coordinates, scene units.
    normals, anchors : (3, K) float64
        Unit normal, and a point of the plane.
    edge_normals, edge_anchors : (E, 3, K) float64
        Inward normals in the plane, and a point of each edge.
    corners : (V, 3, K) float64
    """

    numbers: Integers
    sizes: Floats
    normals: Floats
    anchors: Floats
    edge_normals: Floats
    edge_anchors: Floats
    corners: Floats
