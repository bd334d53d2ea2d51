"""Which module serves which part of the scene language: one line an effect."""

from collections.abc import Callable, Sequence
from typing import Any

import schemas.lights
import schemas.shapes
import schemas.textures
from renderer.assets import AssetSource
from renderer.lights import emitters
from renderer.lights.emitters import Emitter
from renderer.shapes import Family, ellipsoids, meshes, rectangles, triangles
from renderer.textures import Texture, checker, mipmap

BuildFamily = Callable[[Sequence[int], Sequence[Any], AssetSource], Family]

SHAPES: dict[type, BuildFamily] = {
    schemas.shapes.Triangle: triangles.build,
    schemas.shapes.Rectangle: rectangles.build,
    schemas.shapes.Parallelogram: rectangles.build,
    schemas.shapes.Ellipsoid: ellipsoids.build,
    schemas.shapes.Sphere: ellipsoids.build,
    schemas.shapes.Mesh: meshes.build,
    schemas.shapes.MeshFile: meshes.build,
}

LIGHTS: dict[type, Callable[..., Emitter]] = {
    schemas.lights.RectangleLight: emitters.build_rectangle,
    schemas.lights.ParallelogramLight: emitters.build_rectangle,
    schemas.lights.PointLight: emitters.build_point,
    schemas.lights.DirectionalLight: emitters.build_directional,
}

TEXTURES: dict[type, Callable[[Any, AssetSource], Texture]] = {
    schemas.textures.ImageTexture: mipmap.build,
    schemas.textures.CheckerTexture: checker.build,
}
