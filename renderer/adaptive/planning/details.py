"""Materials with decoupled shading: those on which only textures vary within pixels."""

from dataclasses import replace

import numpy as np

import schemas.textures as language
from renderer.adaptive.fine_texture import FineTexture
from renderer.adaptive.lighting import PilotLighting
from renderer.adaptive.quadrature import GAUSS_LEGENDRE, NodeEmitter, Quadrature
from renderer.materials.maps import BumpMap, ColorTexture, NormalMap
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Illumination, Lighting
from renderer.textures.footprints import Footprints, build
from renderer.textures.image import ImageTexture
from schemas.materials import Surface
from schemas.quality import TargetQuality

MAPS = ColorTexture | NormalMap | BumpMap
"""Stages that look up images."""

PENUMBRA_POINT_FACTOR, MAX_PENUMBRA_POINTS = 4, 1024
"""Factor on the light points of penumbrae on such materials, and the most of them: sampled camera rays that
hit fine detail as well cost far more."""


def decoupled(request: Request, lightings: tuple[Illumination, ...]) -> frozenset[str]:
    """Materials with decoupled shading; none without lights."""
    if not lightings:
        return frozenset()
    return frozenset(name for name in request.names if _eligible(request, request.document.materials[name]))


def _eligible(request: Request, material: Surface) -> bool:
    """Whether only images without a pyramid vary within pixels on a material.

    Reflections and refractions vary as well.
    """
    images = _images(request, material)
    sampled = material.mirror or material.transmission or not images
    return not sampled and all(
        isinstance(each, language.ImageTexture) and each.filter != "mipmap" for each in images
    )


def _images(request: Request, material: Surface) -> list[language.Texture]:
    names = (material.color_texture, material.normal_map, material.bump_map)
    return [request.document.textures[name] for name in names if name is not None]


def with_fine_texture(
    plan: RenderPlan, names: list[str], details: frozenset[str], target: TargetQuality
) -> RenderPlan:
    """Add decoupled shading of the materials `details` to a plan of pilot samples, with materials `names`."""
    if not details:
        return plan
    fine = np.array([name in details for name in names])
    texels, relief = np.zeros(fine.size), np.zeros(fine.size, dtype=bool)
    for stage in plan.surfaces:
        if isinstance(stage, MAPS):
            np.maximum(texels, stage.used * fine * _texels(stage), out=texels)
            relief |= stage.used & (not isinstance(stage, ColorTexture))
    first = next(i for i, stage in enumerate(plan.surfaces) if isinstance(stage, MAPS))
    has_footprints = any(isinstance(stage, Footprints) for stage in plan.surfaces)
    footprints = () if has_footprints else (build(plan.camera, 1),)
    lights = FineTexture(
        plain=plan.lightings,
        quadratures={
            side: tuple(_quadrature(light, side) for light in plan.lightings) for side in GAUSS_LEGENDRE
        },
        maps=plan.surfaces[first:],
        texels=texels,
        relief=relief,
        error=target.error,
    )
    surfaces = tuple(
        replace(stage, used=stage.used & ~fine) if isinstance(stage, MAPS) else stage
        for stage in plan.surfaces
    )
    return replace(plan, surfaces=(*surfaces[:first], *footprints, *surfaces[first:]), lightings=(lights,))


def _texels(stage: ColorTexture | NormalMap | BumpMap) -> int:
    """Texels of a stage's image, 0 for other textures."""
    texture = stage.heights.texture if isinstance(stage, BumpMap) else stage.texture
    return texture.texels.shape[0] * texture.texels.shape[1] if isinstance(texture, ImageTexture) else 0


def _quadrature(light: Illumination, side: int) -> Quadrature:
    """Incident light at the centres of pixels, with `side` nodes along each side of an area light."""
    if isinstance(light, PilotLighting):
        nodes = NodeEmitter.of(light.emitter, count=side * side, pattern="uniform")
        partial = light.partial
        count = min(PENUMBRA_POINT_FACTOR * partial.emitter.count, MAX_PENUMBRA_POINTS)
        many = replace(partial, emitter=replace(partial.emitter, count=count))
        return Quadrature(light.probe, many, replace(partial, emitter=nodes, shadows=()))
    assert isinstance(light, Lighting)
    return Quadrature(light, light, light)
