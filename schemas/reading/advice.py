"""Warnings about valid scenes whose picture is probably unintended."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from schemas.cameras import Camera
from schemas.lights import Light, ParallelogramLight, PointLight, RectangleLight, SpotLight
from schemas.materials import shown_textures
from schemas.quantities import (
    Color,
    Vector,
    add,
    cross,
    difference,
    dot,
    length,
    parallel,
    scaled,
    sine_between,
    times,
)
from schemas.reading.findings import Finding
from schemas.scene import Scene, used_materials, used_textures
from schemas.shapes import (
    CenterForm,
    CornerForm,
    Ellipsoid,
    Mesh,
    MeshFile,
    Parallelogram,
    Rectangle,
    Shape,
    Sphere,
    Triangle,
)

CLEARLY_AN_AREA = 1e-12
"""Sine of the angle between two edges of a triangle that surely has an area."""


def no_area(triangle: Triangle) -> bool:
    """Whether a triangle's vertices lie exactly on one line. No tolerance: a sliver is a triangle."""
    return _without_area(*triangle.vertices)


def no_area_at_all(mesh: Mesh) -> bool:
    """Whether the vertices of every single triangle of a mesh lie exactly on one line."""
    return all(_without_area(*(mesh.vertices[number] for number in triangle)) for triangle in mesh.triangles)


def _without_area(a: Vector, b: Vector, c: Vector) -> bool:
    if sine_between(difference(b, a), difference(c, a)) > CLEARLY_AN_AREA:
        return False
    return on_one_line(a, b, c)


def on_one_line(a: Vector, b: Vector, c: Vector) -> bool:
    """Whether three points lie exactly on one line: a double is a whole number over a power of two."""
    ratios = [number.as_integer_ratio() for number in (*a, *b, *c)]
    finest = max(below for _, below in ratios)
    x, y, z, *ends = (above * (finest // below) for above, below in ratios)
    e, f = ([end - start for end, start in zip(ends[i : i + 3], (x, y, z), strict=True)] for i in (0, 3))
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
    if isinstance(light, PointLight | SpotLight):
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
    return any(_intersects(camera, cone, *_ball(thing)) for thing in (*scene.shapes, *seen))


def _intersects(camera: Camera, cone: float, center: Vector, radius: float) -> bool:
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


MAX_AXIS_RATIO = 1e8
"""Largest ratio of two semi-axes of an ellipsoid that keeps its picture exact."""

MIN_PIXEL_ANGLE = 2.0**-45
"""A hundred times the rounding of a ray's direction, radians: the least angle between pixels."""

VISIBLE_ROUNDING = 100 * 2.0**-48
"""A hundred times what sixteen roundings move a point by, in shares of its coordinates."""

MAX_CAMERA_DISTANCES = 2.0**20
"""Distances from the camera; what reaches less far is not at fault where rounding shows."""

# A warning is a courtesy: it must not cost more than the reading.
_MOST_PAIRS = 100_000


def advise(scene: Scene) -> list[Finding]:
    """List valid values that are probably unintended."""
    return [
        *_darkness(scene),
        *_empty_view(scene),
        *_narrow_view(scene),
        *_bright_colors(scene),
        *_up(scene),
        *_unused(scene),
        *_poor_shapes(scene),
        *_large_shapes(scene),
        *_lights_inside(scene),
        *_without_coordinates(scene),
    ]


def _black(color: Color) -> bool:
    return not any(color)


def _darkness(scene: Scene) -> Iterator[Finding]:
    if not all(_black(light.color) for light in scene.lights):
        return
    ambient = not _black(scene.ambient) and any(material.ambient for material in scene.materials.values())
    if ambient:
        detail = "No light shines: every shape shows its ambient colour only. Add a light."
        yield Finding(("lights",), "no_light", detail)
    else:
        detail = "No light shines and there is no ambient light: every shape is black. Add a light."
        yield Finding(("lights",), "black_picture", detail)


def _empty_view(scene: Scene) -> Iterator[Finding]:
    if not in_view(scene):
        detail = "No shape is in view: the picture shows the background only. Turn or move the camera."
        yield Finding(("camera",), "nothing_in_view", detail)


def _narrow_view(scene: Scene) -> Iterator[Finding]:
    camera = scene.camera
    if math.radians(camera.vertical_fov) < MIN_PIXEL_ANGLE * camera.height:
        detail = (
            "The view is so narrow that rounding moves rays by a hundredth of a pixel or more. "
            "Move the camera nearer and widen the view."
        )
        yield Finding(("camera", "vertical_fov"), "narrow_view", detail)


def _bright_colors(scene: Scene) -> Iterator[Finding]:
    for name, material in scene.materials.items():
        if material.color and max(material.color) > 1:
            detail = (
                "This colour reflects more light than it receives. Colours are linear, 0 to 1: divide "
                "values of 0 to 255 by 255 and decode them from sRGB."
            )
            yield Finding(("materials", name, "color"), "bright_color", detail)


def _up(scene: Scene) -> Iterator[Finding]:
    camera = scene.camera
    if parallel(difference(camera.look_at, camera.position), camera.up):
        detail = (
            "'up' is parallel to the view, so the world axis that is farthest from the view takes its place. "
            "Choose another direction to set how the picture is turned."
        )
        yield Finding(("camera", "up"), "up_parallel_to_view", detail)


def _unused(scene: Scene) -> Iterator[Finding]:
    parts = {"materials": scene.materials, "shapes": scene.shapes}
    materials = {name for _, name in used_materials(parts)}
    textures = {name for _, name in used_textures(parts)}
    for name in scene.materials:
        if name not in materials:
            yield Finding(("materials", name), "unused", "No shape uses this material. Use it or remove it.")
    for name in scene.textures:
        if name not in textures:
            yield Finding(("textures", name), "unused", "No material uses this texture. Use it or remove it.")


def _poor_shapes(scene: Scene) -> Iterator[Finding]:
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Triangle) and no_area(shape):
            detail = "This triangle has no area and is left out. Move one of its vertices or remove it."
            yield Finding(("shapes", index, "vertices"), "no_area", detail)
        if isinstance(shape, Mesh) and no_area_at_all(shape):
            detail = (
                "No triangle of this mesh has an area, so nothing of it is seen. Check its vertices and "
                "their numbers, or remove it."
            )
            yield Finding(("shapes", index, "triangles"), "no_area", detail)
        if isinstance(shape, Ellipsoid) and _flat(shape):
            detail = "One axis is more than 1e8 times as long as another: the picture may be inexact."
            yield Finding(("shapes", index, "axes"), "very_flat", detail)


def _without_coordinates(scene: Scene) -> Iterator[Finding]:
    """The first shape of each textured material that has no texture coordinates; files are not read here."""
    bare: dict[str, list[int]] = {}
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Triangle | Mesh) and shape.uvs is None:
            bare.setdefault(shape.material, []).append(index)
    for name, shapes in bare.items():
        if parts := shown_textures(scene.materials[name]):
            detail = no_coordinates(scene.shapes[shapes[0]].type, parts[0], len(shapes) - 1)
            yield Finding(("shapes", shapes[0], "uvs"), "no_texture_coordinates", detail)


def no_coordinates(kind: str, part: str, others: int) -> str:
    """The warning about a shape of a kind whose material has a texture in some part."""
    also = f" The same goes for {others} other shape{'s' * (others > 1)} of this material." if others else ""
    return (
        f"The material has a '{part}', and this {kind} has no texture coordinates: the corners of each "
        f"triangle get (0, 0), (1, 0) and (0, 1). Give it texture coordinates.{also}"
    )


def _large_shapes(scene: Scene) -> Iterator[Finding]:
    """Shapes of which rounding moves points by a hundredth of a pixel where the camera may be near."""
    camera = scene.camera
    pixel = 2 * math.tan(math.radians(camera.vertical_fov) / 2) / camera.height
    view = length(difference(camera.look_at, camera.position))
    most = max(pixel / VISIBLE_ROUNDING, MAX_CAMERA_DISTANCES)
    for index, shape in enumerate(scene.shapes):
        low, high = _box(shape)
        largest = max(map(abs, (*low, *high)))
        if largest <= most * view:
            continue
        beyond = [max(a - x, x - b, 0.0) for x, a, b in zip(camera.position, low, high, strict=True)]
        if largest > most * math.hypot(*beyond):
            detail = (
                "This shape reaches so far that rounding moves points on it by a hundredth of a pixel or "
                "more: its borders, shadows and textures may be inexact. Make it smaller."
            )
            yield Finding(("shapes", index), "very_large", detail)


def _box(shape: Shape) -> tuple[Vector, Vector]:
    """Least and greatest coordinates; of a mesh from a file those of its place, as no more is known here."""
    if isinstance(shape, Triangle | Rectangle | Parallelogram):
        points = shape.vertices if isinstance(shape, Triangle) else corners(shape)
        x, y, z = zip(*points, strict=True)
        return (min(x), min(y), min(z)), (max(x), max(y), max(z))
    if isinstance(shape, Mesh | MeshFile):
        vertices = shape.vertices if isinstance(shape, Mesh) else ()
        farthest = max(map(abs, itertools.chain.from_iterable(vertices)), default=0.0)
        center, radius = shape.translate, math.sqrt(3) * farthest * max(map(abs, shape.scale))
    else:
        center, radius = _ball(shape)
    return difference(center, (radius,) * 3), add(center, (radius,) * 3)


def _flat(shape: Ellipsoid) -> bool:
    lengths = [length(axis) for axis in shape.axes]
    return max(lengths) > MAX_AXIS_RATIO * min(lengths)


def _lights_inside(scene: Scene) -> Iterator[Finding]:
    round_shapes = [
        (index, shape) for index, shape in enumerate(scene.shapes) if isinstance(shape, Ellipsoid | Sphere)
    ]
    lights = enumerate(light_points(light) for light in scene.lights)
    pairs = itertools.islice(itertools.product(lights, round_shapes), _MOST_PAIRS)
    for (light, points), (index, shape) in pairs:
        if points and all(inside(point, shape) for point in points):
            detail = (
                f"This light is inside the ellipsoid /shapes/{index}, so everything outside is in its shadow."
            )
            yield Finding(("lights", light), "light_inside", detail)
