"""Build the plan of target quality from a plan of samples."""

from dataclasses import replace

import numpy as np

from renderer.adaptive.edges import edge_pixels
from renderer.adaptive.lattice import first_stride
from renderer.adaptive.planning import explanations, pilots
from renderer.adaptive.planning.details import decoupled
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.thin_shapes import shadow_pixels, thin_pixels
from renderer.cameras import ThinLens
from renderer.halves import SequenceEmitter, lens_in_sequence
from renderer.math.arrays import Integers
from renderer.plan.effects import SHAPES, TEXTURES
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Lighting
from renderer.plan.strengths import effective
from renderer.scenes import LoadedScene
from renderer.textures import footprints
from renderer.textures.footprints import Footprints
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from schemas.scene import Scene

CAMERA_SAMPLES = Antialiasing(pattern="sobol", samples=16)
"""Camera samples that prices assume, as target quality takes an unknown number."""

FEW_LIGHT_POINTS, MANY_LIGHT_POINTS = 4, 16
"""Light points of each camera sample, whichever is cheaper to the same target: many where only borders and
penumbrae are sampled, few where a texture or a normal map has every pixel sampled."""

SAMPLED_EVERYWHERE = ("color_texture", "normal_map", "bump_map", "displacement_map", "mirror", "transmission")
"""Attributes of a material for which every pixel that shows it is sampled."""


def samples_of(scene: LoadedScene, target: TargetQuality) -> FixedQuality:
    """Quality of the samples of a picture."""
    return FixedQuality(
        mode="fixed",
        antialiasing=CAMERA_SAMPLES,
        light=LightSampling(pattern="sobol", samples=_light_points(effective(scene.document))),
        precision=target.precision,
    )


def _light_points(document: Scene) -> int:
    """Few where every pixel is sampled, or where shadow rays through a tree cost more than the camera ray."""
    if document.camera.lens_radius > 0:
        return FEW_LIGHT_POINTS
    boards = {name for name, texture in document.textures.items() if TEXTURES[type(texture)].mean}
    for shape in document.shapes:
        material = document.materials[shape.material]
        asked = {part for part in SAMPLED_EVERYWHERE if getattr(material, part)}
        if material.color_texture in boards:
            asked.discard("color_texture")
        if asked or SHAPES[type(shape)].meshed:
            return FEW_LIGHT_POINTS
    return MANY_LIGHT_POINTS


def adapted(plan: RenderPlan, request: Request, target: TargetQuality) -> TargetPlan:
    """Build the plan of target quality from that of a request's samples."""
    plan = _in_sequence(plan)
    if request.document.camera.lens_radius > 0:
        made = _made(plan, target, request, frozenset(), None)
        return replace(made, entries=explanations.with_lattice(plan))
    hasty, details = pilots.in_time(target), decoupled(request, plan.lightings)
    seen = pilots.request_of(request, hasty, details)
    # Pilot samples share the camera and the shapes, and so what intersectors precompute.
    pilot = replace(pilots.build_pilot(seen, details, hasty), intersectors=plan.intersectors)
    made = _made(plan, target, seen, details, pilot)
    entries = (*pilot.entries, *explanations.thin_shadows(request, made.thin_shadows))
    return replace(made, pilot=replace(pilot, entries=entries))


def _in_sequence(plan: RenderPlan) -> RenderPlan:
    """The plan with as many samples as the error requires, in two sequences on each light and the lens."""
    return replace(
        plan,
        camera=lens_in_sequence(plan.camera) if isinstance(plan.camera, ThinLens) else plan.camera,
        surfaces=tuple(
            footprints.build(plan.camera, pilots.FILTER_SAMPLES) if isinstance(stage, Footprints) else stage
            for stage in plan.surfaces
        ),
        lightings=tuple(
            replace(light, emitter=SequenceEmitter.of(light.emitter))
            if isinstance(light, Lighting) and light.emitter.count > 1
            else light
            for light in plan.lightings
        ),
        entries=explanations.in_sequence(plan, pilots.FILTER_SAMPLES),
    )


def _made(
    plan: RenderPlan,
    target: TargetQuality,
    seen: Request,
    details: frozenset[str],
    pilot: RenderPlan | None,
) -> TargetPlan:
    """Build the plan, where `seen` is the request of pilot samples, or of samples through a lens."""
    needs_sampling = pilots.materials_with(seen, "normal_map", "bump_map", "mirror", "transmission")
    return TargetPlan.of(
        plan,
        quality=target,
        pilot=pilot,
        textured=pilots.shapes_of(seen, pilots.materials_with(seen, "color_texture") | details),
        averaged=pilots.shapes_of(seen, pilots.averaged_materials(seen) | details),
        detailed=pilots.shapes_of(seen, details),
        needs_sampling=pilots.shapes_of(seen, needs_sampling - details),
        glints=pilots.glints(seen),
        **_places(plan, seen),
    )


def _places(plan: RenderPlan, seen: Request) -> dict[str, Integers]:
    """Fields of a `TargetPlan` that list pixels: through a lens only thin shapes."""
    camera, visible = plan.camera, [light.rectangles for light in plan.visible_lights]
    families, none = [*seen.families, *visible], np.zeros((3, 0), dtype=np.int64)
    piloted = seen.document.camera.lens_radius == 0
    return {
        "thin": thin_pixels(camera, families, first_stride(seen.document.camera)),
        "edges": edge_pixels(camera, families if piloted else ()),
        "lamps": edge_pixels(camera, visible if piloted else ()),
        "thin_shadows": shadow_pixels(plan) if piloted else none,
    }
