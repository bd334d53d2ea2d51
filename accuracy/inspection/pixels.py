"""Explanation of a pixel as a document, and its plan: one ray through the middle of the pixel."""

from collections import Counter
from dataclasses import replace
from typing import cast

from accuracy.inspection.lighting import triple
from accuracy.inspection.paths import Leg, ray_of, walk
from accuracy.inspection.reasons import reasons
from renderer.compiling import compile_scene
from renderer.integrator import radiance
from renderer.interaction import EMITTER
from renderer.math.arrays import lengths, unit
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from schemas.api.inspections import (
    InspectedRay,
    InspectedSurface,
    Inspection,
    Part,
    RayKind,
)
from schemas.pointers import pointer
from schemas.quality import Antialiasing, FixedQuality, LightSampling, Quality, TargetQuality
from schemas.scene import Scene

LIGHT_POINTS = 64
"""Points on each light if the picture has a target error: visible shares are known to 1 or 2 %."""


def inspection_plan(scene: Source | LoadedScene, quality: QualitySource | None = None) -> RenderPlan:
    """Compile a scene for `inspect`.

    Parameters
    ----------
    scene
        Argument or result of `load_scene`.
    quality
        That of the picture. Its precision is kept, and with fixed quality its light points.

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.
    """
    loaded, quality = load_request(scene, quality)
    camera = loaded.document.camera.model_copy(update={"lens_radius": 0.0})
    sharp = replace(loaded, document=loaded.document.model_copy(update={"camera": camera}))
    return compile_scene(sharp, _one_ray(quality))


def _one_ray(quality: Quality | None) -> FixedQuality:
    light = quality.light if isinstance(quality, FixedQuality) else None
    if isinstance(quality, TargetQuality):
        light = LightSampling(pattern="uniform", samples=LIGHT_POINTS)
    return FixedQuality(
        mode="fixed",
        antialiasing=Antialiasing(pattern="center"),
        light=light,
        precision=quality.precision if quality else "single",
    )


def inspect(plan: RenderPlan, x: int, y: int) -> Inspection:
    """Explain what the ray through the middle of a pixel shows.

    Parameters
    ----------
    plan : RenderPlan
        Of `inspection_plan`; any other with one camera sample a pixel and no lens.
    x, y : int
        Column and row, from the upper left.

    Returns
    -------
    Inspection
        Its `color` is the pixel rendered with this plan, before rounding to float32. If the tree is complete,
        weights times radiance add up to it, up to 2^-50 of the sum of magnitudes per ray: only the order of
        summation differs.

    Raises
    ------
    IndexError
        If the picture does not have this pixel.
    """
    if not (0 <= x < plan.width and 0 <= y < plan.height):
        raise IndexError(f"The picture has {plan.width} x {plan.height} pixels; ({x}, {y}) is outside it.")
    color = triple(radiance(plan, ray_of(plan, x, y), Counter())[:, 0])
    root, complete = walk(plan, x, y)
    ray = _ray(plan.document, root)
    why = reasons(plan.document, ray)
    return Inspection(x=x, y=y, color=color, reasons=why, ray=ray, complete=complete)


def _ray(scene: Scene, leg: Leg) -> InspectedRay:
    rays = leg.wave.rays
    return InspectedRay(
        kind=cast("RayKind", leg.kind),
        weight=float(leg.wave.weights[0]),
        origin=triple(rays.origins[:, 0]),
        direction=triple(unit(rays.directions)[:, 0]),
        surface=_surface(scene, leg) if leg.points.count else None,
        light=_light_hit(int(rays.shapes[0])),
        radiance=triple(leg.radiance),
        rays=tuple(_ray(scene, following) for following in leg.legs),
    )


def _light_hit(number: int) -> Part | None:
    return Part(pointer=pointer(["lights", number - EMITTER]), name=None) if number >= EMITTER else None


def _surface(scene: Scene, leg: Leg) -> InspectedSurface:
    points = leg.points
    number = int(points.shapes[0])
    shape = scene.shapes[number]
    texture = scene.materials[shape.material].color_texture
    return InspectedSurface(
        shape=number,
        part=Part(pointer=pointer(["shapes", number]), name=shape.name),
        primitive=int(points.primitives[0]),
        t=float((points.t * lengths(points.directions)).item()),
        position=triple(points.positions[:, 0]),
        uv=cast("tuple[float, float]", tuple(points.coordinates[:, 0].tolist())),
        normal=triple(points.normals[:, 0]),
        shading_normal=triple(points.shading_normals[:, 0]),
        material=Part(pointer=pointer(["materials", shape.material]), name=shape.material),
        texture=None if texture is None else Part(pointer=pointer(["textures", texture]), name=texture),
        color=triple(points.colors[:, 0]),
        ambient=triple(leg.ambient),
        lights=leg.lights,
    )
