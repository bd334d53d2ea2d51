"""The first look that target quality takes at each pixel: one ray, with as little noise as may be."""

from collections.abc import Callable, Iterable
from dataclasses import fields, replace

import numpy as np

import schemas.textures as language
from renderer.accelerators.trees import in_tree
from renderer.adaptive.edges import EDGES
from renderer.adaptive.lighting import CORNERS, SIDES, FirstLook, ProbingEmitter, finest
from renderer.adaptive.shadow_edges import shadow_edge_places
from renderer.cameras import Pinhole
from renderer.lights.emitters import Emitter
from renderer.materials.maps import ColorTexture
from renderer.materials.phong import Phong
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.lights import shadow_stages
from renderer.plan.request import Request
from renderer.plan.stages import Illumination, Lighting, PointStage
from renderer.scenes import LoadedScene
from renderer.shapes import Family
from renderer.textures import footprints
from renderer.textures.averaged import AveragedChecker
from renderer.textures.checker import BoxCheckerTexture
from renderer.textures.means import MeanColor
from schemas.quality import FixedQuality, TargetQuality
from schemas.sampling import Antialiasing, LightSampling

PENUMBRA = 64, 2.0**-8
"""So many points see an error of so much of a light that is half covered; fewer or more by its inverse."""


HASTY = 2.0**-9
"""First looks of pictures with a time limit are no finer than this error needs: all pixels wait for them."""


def in_time(target: TargetQuality) -> TargetQuality:
    """What first looks work for."""
    if target.time_limit is None:
        return target
    return target.model_copy(update={"error": max(target.error, HASTY)})


def request_of(request: Request, target: TargetQuality, detailed: frozenset[str]) -> Request:
    """The request of pilot samples, with the materials that they shade in detail."""
    scene = filtered(request.scene)
    return Request(scene, quality_of(target), request.geometry, request.culling, details=detailed)


def filtered(scene: LoadedScene) -> LoadedScene:
    """The scene with the means of checker boards over a pixel in place of the field that its middle meets."""
    boards = {
        name: texture.model_copy(update={"filter": "box"})
        for name, texture in scene.document.textures.items()
        if isinstance(texture, language.CheckerTexture)
    }
    textures = scene.document.textures | boards
    return replace(scene, document=scene.document.model_copy(update={"textures": textures}))


def shapes_with(request: Request, *parts: str) -> Masks:
    """Shapes (K,) whose material has any of these parts, those shaded in detail left out."""
    materials = request.document.materials
    having = {name for name, material in materials.items() if any(getattr(material, part) for part in parts)}
    having -= request.details
    return np.array([shape.material in having for shape in request.document.shapes], dtype=bool)


def checkered(request: Request) -> Masks:
    """Shapes (K,) whose colour is a checker board's."""
    materials, textures = request.document.materials, request.document.textures
    boards = {name for name, texture in textures.items() if isinstance(texture, language.CheckerTexture)}
    having = {name for name, material in materials.items() if material.color_texture in boards}
    having |= request.details
    return np.array([shape.material in having for shape in request.document.shapes], dtype=bool)


def detailed(request: Request) -> Masks:
    """Shapes (K,) whose material is shaded in detail."""
    shown = [shape.material in request.details for shape in request.document.shapes]
    return np.array(shown, dtype=bool)


def places(families: Iterable[Family], of_corners: Callable[[Floats], Integers]) -> Integers:
    """Pixels (2, N) that hulls of shapes ask to look at; triangles in trees are parts of larger things."""
    found = [np.zeros((2, 0), dtype=np.int64)]
    found += [of_corners(family.corners()) for family in families if not in_tree(family)]
    return np.hstack(found)


def shadow_places(request: Request, emitters: list[Emitter], camera: Pinhole) -> Integers:
    """Pixels (3, N) that edges of hard shadows pass, and the shapes they fall on."""
    hulls = [(family.corners(), family.numbers) for family in request.families if not in_tree(family)]
    flats = [(corners, numbers) for corners, numbers in hulls if corners.shape[0] in EDGES]
    return shadow_edge_places(camera, emitters, [corners for corners, _ in hulls], flats)


def averaged(stage: PointStage, camera: Pinhole, target: TargetQuality) -> PointStage:
    """A stage that looks up colours, with the mean over the pixel of what is a checker board."""
    if not isinstance(stage, ColorTexture) or not isinstance(stage.texture, BoxCheckerTexture):
        return stage
    pixel = footprints.build(camera, 1)
    return MeanColor(AveragedChecker(stage.texture), stage.used, pixel.across, pixel.along, target.error)


def quality_of(target: TargetQuality) -> FixedQuality:
    """One ray through the middle of the pixel, and many points on a light that is seen in part."""
    return FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="center"),
        light=LightSampling(pattern="sobol", samples=_points(target.error)),
        precision=target.precision,
    )


def lightings(
    request: Request,
    target: TargetQuality,
    plain: tuple[Illumination, ...],
    table: Phong,
) -> tuple[Illumination, ...]:
    """A first look for each light; lights without an area are looked at as always."""
    return tuple(
        _first_look(request, target, lighting, table)
        if isinstance(lighting, Lighting) and lighting.emitter.count > 1
        else lighting
        for lighting in plain
    )


def _first_look(request: Request, target: TargetQuality, lighting: Lighting, table: Phong) -> FirstLook:
    emitter = lighting.emitter
    grid = replace(emitter, pattern="uniform")
    values = {item.name: getattr(grid, item.name) for item in fields(Emitter)}
    probing = ProbingEmitter(**values | {"count": CORNERS * CORNERS})
    shadows = tuple(shadow_stages(request, probing)) if lighting.shadows else ()
    return FirstLook(
        probe=replace(lighting, emitter=probing, shadows=shadows, terms=()),
        whole=tuple(replace(lighting, emitter=replace(grid, count=n * n), shadows=()) for n in SIDES),
        partial=lighting,
        finest=finest(target.error, float(emitter.color.max()), table.specular, table.shininess),
    )


def _points(error: float) -> int:
    """Light points in a penumbra, a power of two."""
    points, at = PENUMBRA
    return int(2 ** np.clip(np.round(np.log2(points * at / error)), 3, 10))
