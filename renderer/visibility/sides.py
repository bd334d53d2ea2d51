"""Sides of triangle planes on which points and light points lie, decided without an epsilon."""

import numpy as np

from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, dot, taken
from renderer.math.numerics import PLANE_ERROR
from renderer.self_intersection import settled
from renderer.shapes.triangles import Triangles


def start_sides(
    family: Triangles, view: LightView, positions: Floats, points: Integers, triangles: Integers
) -> Floats:
    """Sides -1, 0 or 1 of the planes of `triangles` (P,) that points at `positions` (3, P) are on.

    0 for a triangle's own points. A point that touches the plane is on the side that its ray came from.

    Parameters
    ----------
    family : Triangles
    view : LightView
    positions : (3, P) float64
    points, triangles : (P,) int64
        Indices of the view's points, and of the family's triangles.
    """
    normals, anchors = (taken(values, triangles) for values in (family.normals, family.vertices[0]))
    rounding = rounding_of(family, view, points, triangles)
    origins = view.origins if view.origins.shape[1] == 1 else taken(view.origins, points)
    sides = np.sign(dot(normals, origins - anchors))
    own = (family.numbers[triangles] == view.of_points(view.points.shapes)[points]) & (
        family.primitives[triangles] == view.of_points(view.points.primitives)[points]
    )
    return np.sign(settled(dot(normals, positions - anchors), rounding, sides, own))


def rounding_of(family: Triangles, view: LightView, points: Integers, triangles: Integers) -> Floats:
    """Bound on the rounding error of points (P,) relative to triangles (P,), scene units."""
    return PLANE_ERROR * (view.of_points(view.points.sizes)[points] + family.sizes[triangles])


def end_sides(
    family: Triangles, emitter: Emitter, positions: Floats, directions: Floats, triangles: Integers
) -> Floats:
    """Sides of the planes that the light points at the ends of rays (3, P) are on, 0 where they touch."""
    normals, anchors = (taken(values, triangles) for values in (family.normals, family.vertices[0]))
    light_points = directions + emitter.weight * positions
    distances = dot(normals, light_points - emitter.weight * anchors)
    rounding = PLANE_ERROR * (family.sizes[triangles] * emitter.weight + emitter.scale)
    return np.where(np.abs(distances) <= rounding, 0.0, np.sign(distances))
