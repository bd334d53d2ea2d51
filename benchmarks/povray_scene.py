"""Write a scene in the scene description language of POV-Ray 3.7, for linear output.

POV-Ray has the same classic Phong terms. What differs: its area light is a grid of point lights with points
on the border, so the grid is shrunk until its points are the centres of cells; its lights are never seen, so
a visible one gets a glowing surface that casts no shadow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from benchmarks.planes import corner_and_edges
from schemas.lights import Light, ParallelogramLight, RectangleLight
from schemas.shapes import Ellipsoid, Parallelogram, Rectangle, Shape, Sphere, Triangle
from schemas.textures import CheckerTexture

if TYPE_CHECKING:
    from collections.abc import Iterable

    from schemas.cameras import Camera
    from schemas.materials import PhongMaterial
    from schemas.scene import Scene


@dataclass(frozen=True)
class LightGrid:
    """How POV-Ray samples area lights.

    Attributes
    ----------
    side : int
        The light is side x side points.
    kind : {"area", "shaded", "points"}
        An `area_light`, shaded as if all light came from its middle; one with `area_illumination`, where each
        point is shaded by itself, but highlights are off in penumbrae; or a point light each, as the radiance
        formula has it.
    adaptive : int or None
        Begin an area light with few points and add others where these disagree: the higher, the more to begin
        with. None takes all points.
    """

    side: int
    kind: Literal["area", "shaded", "points"]
    adaptive: int | None = None


def description(scene: Scene, grid: LightGrid) -> str:
    """Write the scene.

    Raises
    ------
    ValueError
        If it uses something that is not translated: meshes, image textures, normals on single triangles,
        point and directional lights, falloff.
    """
    parts = [
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1.0 ambient_light {_color(scene.ambient)} max_trace_level 1 }}",
        f"background {{ color {_color(scene.background)} }}",
        _camera(scene.camera),
        *(_light(light, grid) for light in scene.lights),
        *(_glow(light) for light in scene.lights if isinstance(light, _AREA) and light.visible),
        *(f"object {{ {_shape(shape)} {_texture(scene, shape)} }}" for shape in scene.shapes),
    ]
    return "\n".join(parts) + "\n"


_AREA = (RectangleLight, ParallelogramLight)


def _vector(values: Iterable[float]) -> str:
    return f"<{', '.join(repr(float(value)) for value in values)}>"


def _color(values: Iterable[float]) -> str:
    return f"rgb {_vector(values)}"


def _camera(camera: Camera) -> str:
    position, look_at, up = (np.array(v) for v in (camera.position, camera.look_at, camera.up))
    forward = (look_at - position) / np.linalg.norm(look_at - position)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    height = 2 * math.tan(math.radians(camera.vertical_fov) / 2)
    across, upward = height * camera.width / camera.height * right, height * np.cross(right, forward)
    return (
        f"camera {{ perspective location {_vector(position)} direction {_vector(forward)} "
        f"right {_vector(across)} up {_vector(upward)} }}"
    )


def _light(light: Light, grid: LightGrid) -> str:
    if not isinstance(light, _AREA) or light.falloff != "none" or not light.two_sided:
        raise ValueError(f"no {light.type} light with these fields is translated")
    corner, first, second = corner_and_edges(light)
    if grid.kind == "points" or grid.side == 1:
        return _points(light, grid.side)
    shrink = (grid.side - 1) / grid.side
    across, along = _vector(shrink * first), _vector(shrink * second)
    adaptive = "" if grid.adaptive is None else f"adaptive {grid.adaptive}"
    area = (
        f"area_light {across}, {along}, {grid.side}, {grid.side} {adaptive} "
        f"area_illumination {'on' if grid.kind == 'shaded' else 'off'}"
    )
    middle = _vector(corner + first / 2 + second / 2)
    return f"light_source {{ {middle} color {_color(light.color)} {area} }}"


def _points(light: RectangleLight | ParallelogramLight, side: int) -> str:
    corner, first, second = corner_and_edges(light)
    cells = (np.arange(side) + 0.5) / side
    color = _color(np.array(light.color) / side**2)
    return "\n".join(
        f"light_source {{ {_vector(corner + u * first + v * second)} color {color} }}"
        for u in cells
        for v in cells
    )


def _glow(light: RectangleLight | ParallelogramLight) -> str:
    finish = "finish { ambient 0 diffuse 0 emission 1 }"
    pigment = f"pigment {{ color {_color(light.color)} }}"
    return f"object {{ {_polygon(*corner_and_edges(light))} {pigment} {finish} no_shadow }}"


def _polygon(corner: Any, first: Any, second: Any) -> str:
    corners = (corner, corner + first, corner + first + second, corner + second, corner)
    return f"polygon {{ 5, {', '.join(_vector(point) for point in corners)} }}"


def _shape(shape: Shape) -> str:
    match shape:
        case Triangle(normals=None):
            return f"triangle {{ {', '.join(_vector(vertex) for vertex in shape.vertices)} }}"
        case Rectangle() | Parallelogram():
            return _polygon(*corner_and_edges(shape))
        case Sphere():
            return f"sphere {{ {_vector(shape.center)}, {shape.radius!r} }}"
        case Ellipsoid():
            rows = np.concatenate([np.ravel(shape.axes), shape.center])
            return f"sphere {{ <0, 0, 0>, 1 matrix {_vector(rows)} }}"
    raise ValueError(f"no {shape.type} with these fields is translated")


def _texture(scene: Scene, shape: Shape) -> str:
    material = scene.materials[shape.material]
    finish = (
        f"finish {{ ambient {material.ambient!r} diffuse {material.diffuse!r} "
        f"phong {material.specular!r} phong_size {material.shininess!r} }}"
    )
    return f"texture {{ pigment {{ {_pigment(scene, shape, material)} }} {finish} }}"


def _pigment(scene: Scene, shape: Shape, material: PhongMaterial) -> str:
    if material.normal_map or material.bump_map or material.displacement_map:
        raise ValueError("no relief is translated")
    if material.color is not None:
        return f"color {_color(material.color)}"
    texture = scene.textures[material.color_texture or ""]
    if not isinstance(texture, CheckerTexture) or not isinstance(shape, Rectangle | Parallelogram):
        raise ValueError("no texture but a checker on a rectangle is translated")
    return _checker(texture, shape)


def _checker(texture: CheckerTexture, shape: Rectangle | Parallelogram) -> str:
    """Cubes of two colours, the rectangle half way up the first layer of them."""
    corner, first, second = corner_and_edges(shape)
    normal = np.cross(first, second)
    rows = np.concatenate(
        [first / texture.repeat[0], second / texture.repeat[1], normal, corner - normal / 2]
    )
    return f"checker color {_color(texture.even)} color {_color(texture.odd)} matrix {_vector(rows)}"
