"""Builder of plans: decides which stages run.

Nothing superfluous is built: no light without colour, no texture that no shape shows, no highlight without
strength. Each stage has the pointers of the scene that requested it.
"""

from dataclasses import replace

import schemas.cameras as language
from renderer import tiling
from renderer.cameras import Pinhole, build_lens, build_pinhole
from renderer.layers import LAYERS, Layer
from renderer.lights import surfaces as light_surfaces
from renderer.math.arrays import column
from renderer.plan import cost, lights, scattering, shapes, surfaces
from renderer.plan.cost import COSTS
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Lighting
from renderer.shapes.family import Location


def build_plan(request: Request) -> RenderPlan:
    """Build the stages in the order in which they run."""
    camera = _camera(request)
    shapes.list_geometry(request, camera)
    emitters = lights.emitters(request)
    intersectors = [shapes.intersector(request, family, camera) for family in request.families]
    intersectors += shapes.overlaps(request)
    visible = lights.visible_lights(request)
    shapes.list_points(request)
    points, bent = surfaces.surfaces(request)
    bounces = scattering.stages(request)
    lightings = tuple(lights.lighting(request, emitter) for emitter in emitters)
    layers = _layers(request)
    surfaces.leave_out_unused(request)
    antialiasing = request.sampling.antialiasing
    return RenderPlan(
        scene=request.scene,
        geometry=request.geometry,
        quality=request.quality,
        camera=camera,
        antialiasing=antialiasing,
        seed=request.sampling.seed,
        passes=tiling.passes(*request.document.camera.picture_size, antialiasing.samples),
        intersectors=tuple(intersectors),
        visible_lights=tuple(visible),
        surfaces=(*shapes.location(request), *points),
        lightings=lightings,
        scattering=bounces,
        unshaded=light_surfaces.Unshaded(
            column(request.document.background),
            light_surfaces.colors([light.color for light in request.document.lights]),
        ),
        materials=surfaces.material_numbers(request),
        bent=bent,
        dtype=request.dtype,
        layers=layers,
        culling=request.culling,
        numerics={
            "degenerate_dropped": request.geometry.degenerate,
            "retried": request.geometry.retried,
        },
        entries=tuple(request.entries),
        left_out=tuple(request.left_out),
    )


def compile_visibility(plan: RenderPlan) -> tuple[Lighting, ...]:
    """One stage per light of the scene, black ones included, that marks blocked points and adds no light."""
    return lights.visibility(Request(plan.scene, plan.quality, plan.geometry, plan.culling))


def with_coordinates(plan: RenderPlan) -> RenderPlan:
    """The plan with texture coordinates of all points, whether or not a texture reads them."""
    stages = [
        replace(stage, reads=stage.reads | {"coordinates"}) if isinstance(stage, Location) else stage
        for stage in plan.surfaces
    ]
    return replace(plan, surfaces=tuple(stages))


def _camera(request: Request) -> Pinhole:
    samples = request.sampling.antialiasing
    detail = f"rays through {samples.samples} {samples.pattern} places in each pixel"
    request.list_stage("camera rays", "camera", detail, ("/camera",), COSTS.camera)
    camera = request.document.camera
    if camera.lens_radius > 0:
        return _lens(request, camera)
    for name in ("lens_radius", "focus_distance"):
        if name in camera.model_fields_set:
            request.leave_out("camera.lens", "the lens radius is 0", f"/camera/{name}")
    return build_pinhole(camera)


def _lens(request: Request, camera: language.Camera) -> Pinhole:
    """A lens asks for two more sample dimensions."""
    lens = build_lens(camera, request.sampling.antialiasing, request.sampling.seed)
    pointers = tuple(f"/camera/{name}" for name in ("lens_radius", "focus_distance") if getattr(camera, name))
    detail = f"a point on the lens for each ray, focused at a distance of {lens.focus:.6g}"
    request.list_stage("lens", "camera.lens", detail, pointers, COSTS.lens)
    return lens


def _layers(request: Request) -> tuple[Layer, ...]:
    """The layers of a request; those that describe the centres of pixels need rays of their own."""
    count = request.sampling.antialiasing.samples
    chosen = tuple(
        replace(LAYERS[name], ground=count) if name == "samples" else LAYERS[name] for name in request.layers
    )
    if any(layer.values for layer in chosen):
        hits = COSTS.shape * cost.near_shapes(sum(family.numbers.size for family in request.families))
        each = (COSTS.camera + hits + COSTS.point) / count
        request.list_stage("rays of layers", "layers", "one ray through the centre of each pixel", each=each)
    if "uv" in request.layers:
        request.reads.add("coordinates")
    for layer in chosen:
        request.list_stage(f"layer {layer.name}", f"layers.{layer.name}", layer.detail)
    return chosen
