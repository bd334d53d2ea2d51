"""Expected cost of stages, in CPU seconds of one core of a machine of 2024.

The figures are rounded from `make bench`; they rank scenes and guard a queue, and are not exact. The share of
shadow tests is what remains after culling on the gallery's scenes.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Costs:
    """Nanoseconds an element.

    Attributes
    ----------
    camera, lens, shape, point, lookup : float
        A camera ray, its place on a lens, a ray against a shape that its block may hit, a point's geometry,
        a texture look-up.
    footprint : float
        Footprint of a sample in a texture.
    faced, bounce : float
        A point and a light, apart from pairs; a further ray with all that it hits.
    diffuse, highlight, falloff, shadow : float
        A pair of point and light point.
    raster : float
        A camera ray against the triangles that cover its place.
    tree, shaft, branch : float
        For each doubling of the triangles in a tree: a ray, a point with the shaft to a light, and a pair of
        point and light point.
    crowd, crowd_shadow, crowd_raster : float
        For each shape of `shapes.crowd`: a ray, a point and a light, and a camera ray against triangles. They
        were measured with 300 spheres and 5,000 triangles in one place, whose prices are now right within a
        factor of 2.
    """

    camera: float = 120.0
    lens: float = 180.0
    shape: float = 12.0
    point: float = 250.0
    lookup: float = 150.0
    footprint: float = 350.0
    faced: float = 400.0
    bounce: float = 3000.0
    diffuse: float = 1.6
    highlight: float = 2.0
    falloff: float = 1.2
    shadow: float = 0.5
    raster: float = 450.0
    tree: float = 110.0
    shaft: float = 170.0
    branch: float = 10.0
    crowd: float = 120.0
    crowd_shadow: float = 350.0
    crowd_raster: float = 550.0


COSTS = Costs()
"""Measured by `make bench`, as the first lines of this module say."""


def near_shapes(shapes: int) -> float:
    """Shapes that a block of rays has to be tested against, of so many: near ones, mostly."""
    return min(shapes, 2.0 + shapes / 8.0)


def through_tree(triangles: int) -> float:
    """Nanoseconds a ray, against that many triangles in a tree."""
    return COSTS.tree * math.log2(triangles)


def shaded_by_tree(triangles: int, light_points: int) -> float:
    """Nanoseconds a point, for its light points against that many triangles in a tree."""
    return (COSTS.shaft + COSTS.branch * light_points) * math.log2(triangles)
