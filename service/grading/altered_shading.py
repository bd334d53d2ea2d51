"""Reproduce mistakes in the formula of Phong's model, for scenes with simple shapes and materials.

`renderer.trace` finds the hits of a grid of rays in each pixel. The effect of a mistake is the difference
between the wrong formula and the right one at the same hits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

import renderer
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from schemas.lights import DirectionalLight, Light, ParallelogramLight, PointLight
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from schemas.scene import Scene
from schemas.shapes import Triangle
from service.grading.altered_normals import from_center, of_gradients, of_spheres

GRID = 3
"""Rays along each side of a pixel."""

LIGHT_POINTS = 16
"""Points that estimate the visibility of an area light; shading then uses its centre alone."""


Bend = Callable[[Scene, Any, Floats, Floats], Floats]
"""Maps a document and the shapes, positions and normals of hits to other normals."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """The hits of N rays.

    Attributes
    ----------
    hit : (N,) bool
    shapes : (N,) int64
    places, normals, viewers : (N, 3) float64
        Normals on the viewer's side, of any length; viewers are unit vectors.
    colors : (N, 3) float64
    diffuse, specular, shininess : (N, 1) float64
    flat : (N, 1) bool
        Whether the shape is flat, so that it cannot shadow itself.
    visibility : (N, lights) float64
    """

    hit: Any
    shapes: Any
    places: Floats
    normals: Floats
    viewers: Floats
    colors: Floats
    diffuse: Floats
    specular: Floats
    shininess: Floats
    flat: Any
    visibility: Floats


@dataclass(frozen=True, slots=True)
class Formula:
    """A variant of Phong's formula; each field that differs from its default is a mistake."""

    clamped: bool = True
    blocked: bool = True
    halfway: bool = False
    unit_light: bool = True
    colored: bool = False


RIGHT = Formula()

FORMULAS = (
    ("cosine_not_clamped", Formula(clamped=False)),
    ("cosine_not_clamped", Formula(clamped=False, blocked=False)),
    ("halfway_vector", Formula(halfway=True)),
    ("light_not_normalised", Formula(unit_light=False)),
    ("highlight_colored", Formula(colored=True)),
)
NORMALS = (
    ("normals_not_normalised", from_center),
    ("normals_not_normalised", of_gradients),
    ("normals_of_spheres", of_spheres),
)


def shading_changes(scene: LoadedScene) -> Iterator[tuple[str, Callable[[], Floats]]]:
    """Mistakes in the formula: a key of `hints.HINTS`, and the change of the linear picture, (H, W, 3).

    Empty for scenes with textures, bounces, meshes or smooth normals.
    """
    if not _plain(scene.document):
        return
    document = scene.document

    @cache
    def points() -> Points:
        return _points(scene)

    @cache
    def right() -> Floats:
        return _direct(document, points(), RIGHT)

    def changed(wrong: Callable[[], Points], formula: Formula) -> Floats:
        return _averaged(_direct(document, wrong(), formula) - right(), document)

    def bent(normals: Bend) -> Points:
        seen = points()
        return replace(seen, normals=normals(document, seen.shapes, seen.places, seen.normals))

    # The caller evaluates likely mistakes twice, with few and with many samples: cache the result.
    for cause, formula in FORMULAS:
        yield cause, cache(partial(changed, points, formula))
    for cause, normals in NORMALS:
        yield cause, cache(partial(changed, partial(bent, normals), RIGHT))


def _plain(document: Scene) -> bool:
    shapes = all(shape.type in ("rectangle", "ellipsoid") or _flat(shape) for shape in document.shapes)
    shown = {shape.material for shape in document.shapes}
    materials = [document.materials[name] for name in shown]
    return (
        shapes
        and bool(document.lights)
        and not document.camera.lens_radius
        and not any(
            m.color_texture or m.normal_map or m.bump_map or m.displacement_map or m.mirror or m.transmission
            for m in materials
        )
    )


def _flat(shape: Any) -> bool:
    return isinstance(shape, Triangle) and shape.normals is None


def _points(scene: LoadedScene) -> Points:
    document = scene.document
    light = LightSampling(pattern="uniform", samples=LIGHT_POINTS)
    quality = FixedQuality(mode="fixed", antialiasing=Antialiasing(pattern="center", samples=1), light=light)
    directions = _directions(document)
    origins = np.broadcast_to(np.array(document.camera.position), directions.shape)
    hits = renderer.trace(renderer.compile_scene(scene, quality), origins, directions)
    materials = [document.materials[shape.material] for shape in document.shapes]
    hit = hits.shape >= 0

    def table(values: list[Any]) -> Floats:
        return np.array(values, dtype=np.float64)[np.where(hit, hits.shape, 0)]

    return Points(
        hit=hit,
        shapes=hits.shape,
        places=np.where(hit[:, None], hits.position, 0),
        normals=np.where(hit[:, None], hits.normal, 0),
        viewers=-directions / np.linalg.norm(directions, axis=1, keepdims=True),
        colors=table([material.color for material in materials]),
        diffuse=table([[material.diffuse] for material in materials]),
        specular=table([[material.specular] for material in materials]),
        shininess=table([[material.shininess] for material in materials]),
        flat=table([[shape.type != "ellipsoid"] for shape in document.shapes]) > 0,
        visibility=hits.visibility,
    )


def _directions(document: Scene) -> Floats:
    """Directions of GRID x GRID rays in each pixel, pixel by pixel, (N, 3)."""
    camera = document.camera
    forward = np.array(camera.look_at) - np.array(camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    rows, columns = (
        (np.arange(GRID * count) + 0.5) / GRID / count * 2 - 1 for count in (camera.height, camera.width)
    )
    half = np.tan(np.radians(camera.vertical_fov) / 2)
    across = half * camera.width / camera.height * columns[None, :, None] * right
    upwards = -half * rows[:, None, None] * np.cross(right, forward)
    every = forward + across + upwards
    blocks = every.reshape(camera.height, GRID, camera.width, GRID, 3).swapaxes(1, 2)
    return np.ascontiguousarray(blocks.reshape(-1, 3))


def _averaged(radiance: Floats, document: Scene) -> Floats:
    camera = document.camera
    means: Floats = radiance.reshape(camera.height, camera.width, GRID * GRID, 3).mean(axis=2)
    return means


def _direct(document: Scene, points: Points, formula: Formula) -> Floats:
    """Diffuse and highlight terms of all lights, (N, 3)."""
    total = np.zeros_like(points.places)
    for number, light in enumerate(document.lights):
        seen = points.visibility[:, number, None]
        total += np.array(light.color) * _term(points, _towards(light, points.places), seen, formula)
    return np.where(points.hit[:, None], total, 0)


def _term(points: Points, towards: Floats, seen: Floats, formula: Formula) -> Floats:
    light = towards / np.linalg.norm(towards, axis=1, keepdims=True) if formula.unit_light else towards
    normals, viewers = points.normals, points.viewers
    cosines = _dot(normals, light)
    gloss = _dot(2 * cosines * normals - light, viewers)
    if formula.halfway:
        between = light + viewers
        gloss = _dot(normals, between / np.linalg.norm(between, axis=1, keepdims=True))
    high = points.specular * np.where(cosines > 0, np.maximum(gloss, 0) ** points.shininess, 0)
    if formula.colored:
        high = high * points.colors
    matt = points.diffuse * points.colors
    if formula.clamped:
        return seen * (matt * np.maximum(cosines, 0) + high)
    # Light from below the horizon: an ellipsoid shadows itself, a flat shape does not.
    open_ = points.flat if formula.blocked else np.ones_like(points.flat)
    seen = np.where((cosines < 0) & open_, 1.0, seen)
    return seen * (matt * cosines + high)


def _dot(a: Floats, b: Floats) -> Floats:
    products: Floats = (a * b).sum(axis=1, keepdims=True)
    return products


def _towards(light: Light, places: Floats) -> Floats:
    """Vectors from points to the light or to its centre, (N, 3)."""
    if isinstance(light, DirectionalLight):
        return np.broadcast_to(-np.array(light.direction), places.shape)
    if isinstance(light, PointLight):
        middle = np.array(light.position)
    elif isinstance(light, ParallelogramLight):
        middle = np.array(light.corner) + np.sum(light.edges, axis=0) / 2
    else:
        middle = np.array(light.center)
    return np.asarray(middle - places)
