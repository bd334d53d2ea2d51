"""The little geometry that warnings need, in plain Python: it runs once a scene, not once a ray."""

from __future__ import annotations

import math
from fractions import Fraction

from schemas.cameras import Camera
from schemas.lights import Light, ParallelogramLight, PointLight, RectangleLight
from schemas.planar import CenterForm, CornerForm
from schemas.scene import Scene
from schemas.shapes import Ellipsoid, Mesh, MeshFile, Shape, Sphere, Triangle
from schemas.vectors import Vector, add, cross, difference, dot, length, scaled, sine_between, times

CLEARLY_AN_AREA = 1e-12
"""Sine of the angle between two edges of a triangle that surely has an area."""


def no_area(triangle: Triangle) -> bool:
    """Whether a triangle's vertices lie exactly on one line. No tolerance: a sliver is a triangle."""
    return _flat(*triangle.vertices)


def no_area_at_all(mesh: Mesh) -> bool:
    """Whether the vertices of every single triangle of a mesh lie exactly on one line."""
    return all(_flat(*(mesh.vertices[number] for number in triangle)) for triangle in mesh.triangles)


def _flat(a: Vector, b: Vector, c: Vector) -> bool:
    if sine_between(difference(b, a), difference(c, a)) > CLEARLY_AN_AREA:
        return False
    return on_one_line(a, b, c)


def on_one_line(a: Vector, b: Vector, c: Vector) -> bool:
    """Whether three points lie exactly on one line."""
    exact_a, exact_b, exact_c = (tuple(map(Fraction, vertex)) for vertex in (a, b, c))
    e, f = ([q - p for p, q in zip(exact_a, end, strict=True)] for end in (exact_b, exact_c))
    return all(e[i] * f[j] == e[j] * f[i] for i, j in ((0, 1), (0, 2), (1, 2)))


def corners(figure: CenterForm | CornerForm) -> tuple[Vector, Vector, Vector, Vector]:
    """Four corners of a rectangle or parallelogram."""
    if isinstance(figure, CornerForm):
        a, (e, f) = figure.corner, figure.edges
        b = add(a, e)
        return a, b, add(b, f), add(a, f)
    normal, tangent = _unit(figure.normal), _unit(figure.tangent)
    cotangent = _unit(cross(normal, tangent))
    right = times(figure.size[0] / 2, cross(cotangent, normal))
    up = times(figure.size[1] / 2, cotangent)
    low, high = difference(figure.center, up), add(figure.center, up)
    return difference(low, right), add(low, right), add(high, right), difference(high, right)


def light_points(light: Light) -> tuple[Vector, ...]:
    """Points whose convex hull is the light; none for a light infinitely far away."""
    if isinstance(light, PointLight):
        return (light.position,)
    return corners(light) if isinstance(light, RectangleLight | ParallelogramLight) else ()


def inside(point: Vector, shape: Ellipsoid | Sphere) -> bool:
    """Whether a point lies strictly inside an ellipsoid."""
    offset = difference(point, shape.center)
    if isinstance(shape, Sphere):
        return length(offset) < shape.radius
    # The coordinate along a semi-axis a is offset . a / a . a, here in factors that do not overflow.
    along = [dot(offset, _unit(axis)) / length(axis) for axis in shape.axes]
    return math.hypot(*along) < 1


def in_view(scene: Scene) -> bool:
    """Whether something may be in the picture; only a sure no is a no.

    A shape stands for the sphere around it, and the picture for the cone around its corners.
    """
    camera = scene.camera
    cone = math.atan(
        math.tan(math.radians(camera.vertical_fov) / 2) * math.hypot(1, camera.width / camera.height)
    )
    seen = (light for light in scene.lights if isinstance(light, CenterForm | CornerForm) and light.visible)
    return any(_meets(camera, cone, *_ball(thing)) for thing in (*scene.shapes, *seen))


def _meets(camera: Camera, cone: float, center: Vector, radius: float) -> bool:
    view = difference(camera.look_at, camera.position)
    offset = difference(center, camera.position)
    distance = length(offset)
    if distance <= radius:
        return True
    unit_view, unit_offset = _unit(view), _unit(offset)
    away = math.atan2(length(cross(unit_view, unit_offset)), dot(unit_view, unit_offset))
    return away <= cone + math.asin(radius / distance) + 1e-6


def _ball(thing: Shape | RectangleLight | ParallelogramLight) -> tuple[Vector, float]:
    if isinstance(thing, Sphere):
        return thing.center, thing.radius
    if isinstance(thing, Ellipsoid):
        return thing.center, max(length(axis) for axis in thing.axes)
    if isinstance(thing, Mesh | MeshFile):
        # Where its file puts it is not known here.
        return (0.0, 0.0, 0.0), math.inf
    points = thing.vertices if isinstance(thing, Triangle) else corners(thing)
    return points[0], max(length(difference(point, points[0])) for point in points)


def _unit(a: Vector) -> Vector:
    a = scaled(a)
    return times(1 / length(a), a)
