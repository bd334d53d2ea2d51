"""Scenes that reproduce one mistake of a program, to compare with a wrong picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from accuracy.comparison.shown import names_of
from accuracy.variations import variants
from renderer.scenes import LoadedScene
from schemas.lights import Light, ParallelogramLight, RectangleLight
from schemas.materials import PhongMaterial, Surface
from schemas.scene import Scene
from schemas.shapes import Parallelogram, Triangle
from service.grading.mistakes.altered_rays import Change, altered_cameras, with_last_hits
from service.grading.mistakes.altered_shading import altered_shading, is_lit
from service.grading.mistakes.altered_textures import altered_textures
from service.grading.mistakes.hints import HINTS

MOST_SHAPES = 40
"""In scenes with more shapes, leaving out single shapes is not tried."""

UPWARDS = (0.0, 1.0, 0.0)
"""The default of `up`, used by a program that ignores the field."""


@dataclass(frozen=True, slots=True)
class Alteration:
    """A scene with one mistake.

    Attributes
    ----------
    cause : str
        A key of `hints.HINTS`; empty for a scene without a mistake.
    about : str
        What the hint says about this scene.
    change : callable or None
        A mistake that no scene has, made in its plan.
    place : int
        Which of the scene's alterations this is; -1 for none.
    """

    cause: str
    scene: LoadedScene
    about: str = ""
    change: Change | None = None
    place: int = -1


def alterations(scene: LoadedScene) -> Iterator[Alteration]:
    """All mistakes that apply to a scene."""
    for place, alteration in enumerate(_applying(scene)):
        yield replace(alteration, place=place)


def _applying(scene: LoadedScene) -> Iterator[Alteration]:
    document = scene.document
    yield from _without(scene)
    updates = [*_cameras(document), *_shapes(document)]
    if is_lit(document):
        updates += [*_lights(document), *_shininess(document)]
    for cause, about, update in updates:
        yield Alteration(cause, _with(scene, update), about)
    for cause, change in (*altered_cameras(document), *altered_shading(document)):
        yield Alteration(cause, scene, change=change)
    if len(document.shapes) > 1:
        yield Alteration("last_hit_drawn", scene, change=with_last_hits)
    for cause, altered in altered_textures(scene):
        yield Alteration(cause, altered)


def _with(scene: LoadedScene, update: Mapping[str, Any]) -> LoadedScene:
    return LoadedScene(scene.document.model_copy(update=dict(update)), scene.assets)


def _without(scene: LoadedScene) -> Iterator[Alteration]:
    """Scenes with one effect, light or term left out."""
    document = scene.document
    for variant in variants(document):
        cause = f"{variant.effect.replace(' ', '_')}_missing"
        if cause in HINTS:
            yield Alteration(cause, LoadedScene(variant.document, scene.assets))
    for number in range(len(document.lights) if is_lit(document) else 0):
        others = document.lights[:number] + document.lights[number + 1 :]
        yield Alteration("light_missing", _with(scene, {"lights": others}), f"lights/{number}")
    if any(document.ambient):
        yield Alteration("ambient_missing", _with(scene, {"ambient": (0.0, 0.0, 0.0)}))


Update = tuple[str, str, Mapping[str, Any]]
"""Cause, what the hint says about the scene, and the changes to the document."""

MISPLACED = (
    (0.5, 1.0, "half of its size too far along both edges, as if u and v ranged from 0.5 to 1.5"),
    (-0.5, 1.0, "half of its size too far back along both edges, as if `corner` were its centre"),
    (0.0, 2.0, "twice as wide and as long as it is, as if its edges started at the centre"),
    (0.0, 0.5, "half as wide and as long as it is"),
)
"""Shift as a share of the edges, scale, and the text of the hint."""


def _lights(document: Scene) -> Iterator[Update]:
    """Area lights sampled wrongly, and falloff switched on or off by mistake."""
    flat = any(isinstance(light, RectangleLight | ParallelogramLight) for light in document.lights)
    if flat:
        point = document.sampling.light.model_copy(update={"pattern": "uniform", "samples": 1})
        yield "hard_shadows", "", {"sampling": document.sampling.model_copy(update={"light": point})}
    for shift, size, about in MISPLACED if flat else ():
        moved = tuple(_moved(light, shift, size) for light in document.lights)
        yield "light_misplaced", about, {"lights": moved}
    if any(hasattr(light, "falloff") for light in document.lights):
        yield "falloff", "", {"lights": tuple(map(_with_other_falloff, document.lights))}


def _moved(light: Light, shift: float, size: float) -> Light:
    """The light, if it has edges, shifted along both by a share of them, and scaled about its centre."""
    if isinstance(light, RectangleLight):
        grown = {"size": tuple(size * side for side in light.size)}
        return light.model_copy(update=grown) if shift == 0 else light
    if not isinstance(light, ParallelogramLight):
        return light
    first, second = light.edges
    start = shift + (1 - size) / 2
    corner = tuple(c + start * (a + b) for c, a, b in zip(light.corner, first, second, strict=True))
    edges = tuple(tuple(size * x for x in edge) for edge in light.edges)
    return light.model_copy(update={"corner": corner, "edges": edges})


def _with_other_falloff(light: Light) -> Light:
    other = {"physical": "none", "none": "physical"}.get(getattr(light, "falloff", ""))
    return light.model_copy(update={"falloff": other}) if other else light


SHININESS = {"twice as large": 2.0, "half as large": 0.5}
"""Text of the hint, and factor."""


def _shininess(document: Scene) -> Iterator[Update]:
    """Highlights that are too narrow or too wide."""
    materials: Mapping[str, Surface] = document.materials
    phong = {name: each for name, each in materials.items() if isinstance(each, PhongMaterial)}
    if not any(material.specular for material in phong.values()):
        return
    for about, factor in SHININESS.items():
        changed = {
            name: material.model_copy(update={"shininess": factor * material.shininess})
            for name, material in phong.items()
        }
        yield "shininess", about, {"materials": {**materials, **changed}}


def _cameras(document: Scene) -> Iterator[Update]:
    """Misread fields of view, and an ignored `up`."""
    camera = document.camera
    aspect, half = camera.width / camera.height, math.tan(math.radians(camera.vertical_fov) / 2)
    angles = {
        "too large by a factor of 2": 2 * camera.vertical_fov,
        "too small by a factor of 2": camera.vertical_fov / 2,
        "taken as horizontal": math.degrees(2 * math.atan(half / aspect)),
    }
    for about, angle in angles.items():
        if angle < 180 and angle != camera.vertical_fov:
            yield "field_of_view", about, {"camera": camera.model_copy(update={"vertical_fov": angle})}
    if camera.up != UPWARDS:
        yield "up_ignored", "", {"camera": camera.model_copy(update={"up": UPWARDS})}


def _shapes(document: Scene) -> Iterator[Update]:
    """All triangles extended to parallelograms, or one shape left out."""
    if any(isinstance(shape, Triangle) for shape in document.shapes):
        whole = [_doubled(shape) if isinstance(shape, Triangle) else shape for shape in document.shapes]
        yield "triangles_too_large", "", {"shapes": tuple(whole)}
    if len(document.shapes) > MOST_SHAPES:
        return
    for number, name in enumerate(names_of(document)):
        others = document.shapes[:number] + document.shapes[number + 1 :]
        yield "shape_missing", name, {"shapes": others}


def _doubled(triangle: Triangle) -> Parallelogram:
    corner = triangle.vertices[0]
    edges = [[q - p for p, q in zip(corner, vertex, strict=True)] for vertex in triangle.vertices[1:]]
    return Parallelogram.model_validate(
        {"type": "rectangle", "corner": corner, "edges": edges, "material": triangle.material}
    )
