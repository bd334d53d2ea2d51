"""From a scene to a plan. Nothing else decides what runs.

What a scene does not call for is not built: no light without colour, no texture that no shape shows, no
highlight of strength 0. What is built carries the lines of the scene that asked for it.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import schemas.cameras as language
from renderer import tiling
from renderer.adaptive.edges import edge_places
from renderer.adaptive.halves import lens_in_sequence
from renderer.adaptive.policies import PilotSamples, SampledLattice
from renderer.adaptive.thin import thin_places
from renderer.cameras import Pinhole, pinhole, thin_lens
from renderer.lights import surfaces as light_surfaces
from renderer.materials import phong
from renderer.math.arrays import column
from renderer.plan import cost, details, first_looks, lights, overlaps, shapes, surfaces, told_looks
from renderer.plan import layers as layer_stages
from renderer.plan import scattering as spawners
from renderer.plan.cost import COSTS
from renderer.plan.geometry import build_geometry
from renderer.plan.plan import AdaptivePlan, RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Lighting
from renderer.scenes import LoadedScene, QualitySource, Source, load_request
from schemas.layers import checked_layers
from schemas.quality import TargetQuality


def compile_scene(
    scene: Source | LoadedScene,
    quality: QualitySource | None = None,
    *,
    layers: Iterable[str] = (),
    culling: bool = True,
) -> RenderPlan:
    """Decide what a scene calls for, and build just that.

    Parameters
    ----------
    scene
        What `load_scene` takes or gives.
    quality
        Takes the place of the scene's own sampling: `schemas.FixedQuality`, `schemas.TargetQuality`, or a
        dict as a request over HTTP has it.
    layers
        What to tell about each pixel beside its colour, by names of `schemas.layers.LAYER_NAMES`.
    culling
        Whether conservative tests may leave out work. Images are the same without, and slower.

    Returns
    -------
    RenderPlan

    Raises
    ------
    SceneError
        If the scene, a file that it names, or the quality cannot be used; pointers into the quality begin
        with ``/quality``.
    ValueError
        If there is no layer of some name.
    """
    names = checked_layers(layers)
    loaded, asked = load_request(scene, quality)
    return _compiled(Request(loaded, asked, build_geometry(loaded), culling, names))


def at_quality(plan: RenderPlan, quality: QualitySource) -> RenderPlan:
    """The plan of the same scene and layers at another quality; raises as `compile_scene` does for it."""
    loaded, asked = load_request(plan.scene, quality)
    names = tuple(layer.name for layer in plan.layers)
    return _compiled(Request(loaded, asked, plan.geometry, plan.culling, names))


def _compiled(request: Request) -> RenderPlan:
    plan = _plan(request)
    if request.target is None:
        return plan
    return replace(plan, adaptive=_adaptive(request, plan, request.target))


def _adaptive(request: Request, plan: RenderPlan, target: TargetQuality) -> AdaptivePlan:
    """What target quality needs beside the plan of its samples."""
    lens = request.document.camera.lens_radius > 0
    visible = [light.rectangles for light in plan.visible_lights]
    emitters = [lighting.emitter for lighting in plan.lightings]
    shadow_edges = first_looks.shadow_places(request, [] if lens else emitters, plan.camera)
    pilot, seen = None, request
    if not lens:
        target = first_looks.in_time(target)
        seen = first_looks.request_of(request, target, details.materials(request, plan.lightings))
        # The same shapes and the same camera: what is formed of them for its rays serves both.
        pilot = replace(_pilot(seen, target), meetings=plan.meetings)
        pilot = replace(pilot, entries=(*pilot.entries, *told_looks.shadow_edges(request, shadow_edges)))
    return AdaptivePlan(
        policy=SampledLattice() if lens else PilotSamples(),
        pilot=pilot,
        textured=first_looks.shapes_with(seen, "color_texture") | first_looks.detailed(seen),
        averaged=first_looks.checkered(seen),
        detailed=first_looks.detailed(seen),
        needs_sampling=first_looks.shapes_with(seen, "normal_map", "bump_map", "mirror", "transmission"),
        thin=first_looks.places(request.families, partial(thin_places, plan.camera)),
        edges=first_looks.places([*request.families, *visible], partial(edge_places, plan.camera)),
        shadow_edges=shadow_edges,
    )


def _pilot(seen: Request, target: TargetQuality) -> RenderPlan:
    """The plan of pilot samples."""
    plan = _plan(seen)
    lightings = first_looks.lightings(seen, target, plan.lightings, _table(seen))
    return replace(
        plan,
        surfaces=tuple(first_looks.averaged(stage, plan.camera, target) for stage in plan.surfaces),
        lightings=details.lightings(seen, target, lightings),
        entries=tuple(told_looks.entries(seen, lightings)),
    )


def compile_visibility(plan: RenderPlan) -> tuple[Lighting, ...]:
    """One stage a light of the scene, black ones too, that marks what blocks it and adds nothing."""
    return lights.visibility(Request(plan.scene, plan.quality, plan.geometry, plan.culling))


def _plan(request: Request) -> RenderPlan:
    """Build the stages in the order in which they run."""
    camera = _camera(request)
    shapes.list_geometry(request)
    emitters = lights.emitters(request)
    meetings = [shapes.meeting(request, family, camera) for family in request.families]
    meetings += overlaps.stages(request)
    visible = lights.visible_lights(request)
    table = _table(request)
    points, bent = surfaces.surfaces(request, table)
    bounces = spawners.spawners(request)
    antialiasing = request.sampling.antialiasing
    return RenderPlan(
        scene=request.scene,
        geometry=request.geometry,
        quality=request.quality,
        camera=camera,
        antialiasing=antialiasing,
        seed=request.sampling.seed,
        passes=tiling.passes(camera.width, camera.height, antialiasing.samples),
        meetings=tuple(meetings),
        visible_lights=tuple(visible),
        surfaces=tuple(points),
        lightings=tuple(lights.lighting(request, emitter, table) for emitter in emitters),
        spawners=bounces,
        unshaded=light_surfaces.Unshaded(
            column(request.document.background),
            light_surfaces.colors([light.color for light in request.document.lights]),
        ),
        materials=surfaces.material_numbers(request),
        bent=bent,
        dtype=request.dtype,
        layers=layer_stages.layers(request),
        culling=request.culling,
        numerics={
            "degenerate_dropped": request.geometry.degenerate,
            "retried": request.geometry.retried,
        },
        entries=tuple(request.listing.entries),
        left_out=(*request.listing.left_out, *surfaces.unused(request)),
    )


def _table(request: Request) -> phong.Phong:
    return phong.build([request.document.materials[name] for name in request.names])


def _camera(request: Request) -> Pinhole:
    samples = request.sampling.antialiasing
    detail = f"rays through {samples.samples} {samples.pattern} places in each pixel"
    if request.target:
        detail = f"rays through {samples.pattern} places in pixels, as many as the error asks for"
    request.listing.add(
        "camera rays", "camera", detail, ("/camera",), cost.seconds(request.rays, COSTS.camera)
    )
    camera = request.document.camera
    if camera.lens_radius > 0:
        return _lens(request, camera)
    for name in ("lens_radius", "focus_distance"):
        if name in camera.model_fields_set:
            request.listing.leave_out("camera.lens", "/camera/lens_radius is 0", (f"/camera/{name}",))
    return pinhole.build(camera)


def _lens(request: Request, camera: language.Camera) -> Pinhole:
    """A lens asks for two more sample dimensions."""
    lens = thin_lens.build(camera, request.sampling.antialiasing, request.sampling.seed)
    pointers = tuple(f"/camera/{name}" for name in ("lens_radius", "focus_distance") if getattr(camera, name))
    detail = f"a place on the lens for each ray, in focus at a distance of {lens.focus:.6g}"
    request.listing.add("lens", "camera.lens", detail, pointers, cost.seconds(request.rays, COSTS.lens))
    if not request.target:
        return lens
    stride = SampledLattice().first_stride(camera.width, camera.height)
    detail = f"pixels {stride} apart are sampled, and those between where the picture is not smooth there"
    request.listing.add("lattice of samples", "camera.lens", detail, pointers)
    return lens_in_sequence(lens)
