"""Build the plan of pilot samples: one ray through the centre of each pixel, with little noise."""

from collections.abc import Container
from dataclasses import replace

import numpy as np

from renderer.adaptive.lighting import SIDES, PilotLighting, ProbingEmitter, grid_sides, probe_side
from renderer.adaptive.planning import explanations
from renderer.adaptive.planning.details import with_fine_texture
from renderer.cameras import Pinhole
from renderer.materials.maps import ColorTexture, NormalMap
from renderer.math.arrays import Floats, Masks
from renderer.plan.building import build_plan
from renderer.plan.effects import MATERIALS, TEXTURES
from renderer.plan.lights import shadow_stages
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Illumination, Lighting, PointStage
from renderer.scenes import LoadedScene
from renderer.textures import footprints
from renderer.textures.checker import AveragedChecker, BoxCheckerTexture
from renderer.textures.means import MeanColor
from renderer.textures.mipmap import MipmapTexture
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality

PENUMBRA_POINTS = 64, 2.0**-8
"""Light points in a penumbra, and the error for which they suffice; in inverse proportion for other
errors."""

FILTER_SAMPLES = 256
"""Samples per pixel that textures are filtered for, as their number is not known before."""

MIN_TIMED_ERROR = 2.0**-9
"""Least target of the pilot samples of pictures with a time limit, as all pixels wait for them."""


def in_time(target: TargetQuality) -> TargetQuality:
    """Target of pilot samples."""
    if target.time_limit is None:
        return target
    return target.model_copy(update={"error": max(target.error, MIN_TIMED_ERROR)})


def request_of(request: Request, target: TargetQuality, details: frozenset[str]) -> Request:
    """Request of pilot samples; materials with decoupled shading, `details`, need footprints."""
    reads = {"coordinates", "derivatives", "viewers"} if details else set()
    quality = quality_of(target)
    return Request(filtered(request.scene), quality, request.geometry, request.culling, reads=reads)


def filtered(scene: LoadedScene) -> LoadedScene:
    """Replace checkerboards by their means over a pixel."""
    written = scene.document.textures
    means = {
        name: mean(texture) for name, texture in written.items() if (mean := TEXTURES[type(texture)].mean)
    }
    textures = written | means
    return replace(scene, document=scene.document.model_copy(update={"textures": textures}))


def shapes_of(request: Request, materials: Container[str]) -> Masks:
    """Shapes (K,) with one of some materials."""
    return np.array([shape.material in materials for shape in request.document.shapes], dtype=bool)


def materials_with(request: Request, *parts: str) -> set[str]:
    """Materials with any of some attributes."""
    materials = request.document.materials
    return {name for name, material in materials.items() if any(getattr(material, part) for part in parts)}


def averaged_materials(request: Request) -> set[str]:
    """Materials whose texture has a known mean over a pixel."""
    textures = request.document.textures
    known = {name for name, texture in textures.items() if TEXTURES[type(texture)].mean}
    return {name for name, each in request.document.materials.items() if each.color_texture in known}


def glints(request: Request) -> Floats:
    """Brightness of the brightest visible light as each shape (K,) reflects it, 0 if not above white."""
    document = request.document
    visible = [max(light.color) for light in document.lights if getattr(light, "visible", False)]
    materials = [document.materials[shape.material] for shape in document.shapes]
    shares = np.array([material.mirror + material.transmission for material in materials], dtype=np.float64)
    brightness = shares * max(visible, default=0.0)
    return np.where(brightness > 1, brightness, 0.0)


def build_pilot(seen: Request, details: frozenset[str], target: TargetQuality) -> RenderPlan:
    """Build the plan of pilot samples from their request."""
    plan = build_plan(seen)
    lightings = _lightings(seen, target, plan.lightings)
    plan = replace(
        plan,
        surfaces=tuple(averaged(stage, plan.camera, target) for stage in plan.surfaces),
        lightings=lightings,
        entries=tuple(explanations.entries(seen, details, lightings)),
    )
    return with_fine_texture(plan, seen.names, details, target)


def averaged(stage: PointStage, camera: Pinhole, target: TargetQuality) -> PointStage:
    """Replace the texture lookup of a stage by the one of pilot samples.

    A checkerboard by its mean over a pixel. Images with a pyramid keep the footprint of samples, as the
    pyramid's mean over a whole pixel at a grazing angle is blurred over many.
    """
    if isinstance(stage, ColorTexture | NormalMap) and isinstance(stage.texture, MipmapTexture):
        return replace(stage, texture=replace(stage.texture, share=1 / np.sqrt(FILTER_SAMPLES)))
    if not isinstance(stage, ColorTexture) or not isinstance(stage.texture, BoxCheckerTexture):
        return stage
    pixel = footprints.build(camera, 1)
    return MeanColor(AveragedChecker(stage.texture), stage.used, pixel.across, pixel.along, target.error)


def quality_of(target: TargetQuality) -> FixedQuality:
    """One ray through the middle of the pixel, and many points on a partially occluded light."""
    return FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="center"),
        light=LightSampling(pattern="sobol", samples=_points(target.error)),
        precision=target.precision,
    )


def _lightings(
    request: Request, target: TargetQuality, plain: tuple[Illumination, ...]
) -> tuple[Illumination, ...]:
    """Replace area lights by their pilot lighting."""
    return tuple(
        _pilot_lighting(request, target, lighting)
        if isinstance(lighting, Lighting) and lighting.emitter.count > 1
        else lighting
        for lighting in plain
    )


def _pilot_lighting(request: Request, target: TargetQuality, lighting: Lighting) -> PilotLighting:
    emitter = lighting.emitter
    grid = replace(emitter, pattern="uniform")
    probing = ProbingEmitter.of(grid, count=probe_side(target.error) ** 2)
    shadows = tuple(shadow_stages(request, probing)) if lighting.shadows else ()
    curvatures = np.array([MATERIALS[type(each)].curvature(each) for each in request.materials])
    return PilotLighting(
        probe=replace(lighting, emitter=probing, shadows=shadows, terms=()),
        whole=tuple(replace(lighting, emitter=replace(grid, count=n * n), shadows=()) for n in SIDES),
        partial=lighting,
        grid_sides=grid_sides(target.error, float(emitter.color.max()), curvatures),
    )


def _points(error: float) -> int:
    """Light points in a penumbra, a power of two."""
    points, at = PENUMBRA_POINTS
    return int(2 ** np.clip(np.round(np.log2(points * at / error)), 3, 10))
