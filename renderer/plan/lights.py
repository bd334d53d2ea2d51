"""Stages of each light."""

from collections.abc import Iterable

import numpy as np

from renderer.accelerators.trees import in_tree
from renderer.lights import surfaces as light_surfaces
from renderer.lights.emitters import Emitter
from renderer.materials.reflection import LightTerm
from renderer.math.arrays import column, dot
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.effects import LIGHTS, MATERIALS, occluder_of
from renderer.plan.request import Request
from renderer.plan.scattering import transparent
from renderer.plan.stages import Lighting, LightStage
from renderer.shapes import Family
from renderer.shapes.family import HULL_MARGIN


def emitter_of(request: Request, number: int) -> Emitter:
    """A light of the scene, with its sampling."""
    light = request.document.lights[number]
    return LIGHTS[type(light)].build(number, light, request.sampling.light, request.sampling.seed)


def emitters(request: Request) -> list[Emitter]:
    """Lights that can contribute."""
    shining = []
    answering = any(MATERIALS[type(material)].reflects(material) for material in request.materials)
    for number, light in enumerate(request.document.lights):
        pointer, effect = f"/lights/{number}", f"lights.{light.type}"
        if not any(light.color):
            request.leave_out(effect, f"/lights/{number} is black", pointer)
        elif not answering:
            request.leave_out(effect, "no material in use reflects light", pointer)
        elif _unseen(emitter := emitter_of(request, number), request.families):
            request.leave_out(effect, f"/lights/{number} faces away from every shape", pointer)
        else:
            shining.append(emitter)
    return shining


def _unseen(emitter: Emitter, families: Iterable[Family]) -> bool:
    """Whether a light shines to one side or into a cone, and all shapes lie behind its plane.

    Shapes that reach up to the plane within `HULL_MARGIN` are left to the rule for points (`facing`), which
    finds them unlit: rounding may put a point beyond its shape.
    """
    if emitter.least_cosine is None:
        return False
    height = dot(emitter.centre, emitter.normal)
    return all(
        bool(np.all(family.reach(emitter.normal) + HULL_MARGIN * (family.sizes + emitter.size) < height))
        for family in families
    )


def visible_lights(request: Request) -> list[light_surfaces.LightSurfaces]:
    """Rectangles that the camera sees, black ones too: they hide what is behind them."""
    numbers = [i for i, light in enumerate(request.document.lights) if getattr(light, "visible", False)]
    if not numbers:
        return []
    seen = [emitter_of(request, i) for i in numbers]
    pointers = tuple(f"/lights/{i}" for i in numbers)
    detail, each = "rays that hit a light see its flat colour", COSTS.shape * len(numbers)
    request.list_stage("visible lights", "lights.rectangle", detail, pointers, each)
    return [light_surfaces.build(seen)]


def lighting(request: Request, emitter: Emitter) -> Lighting:
    """All stages of one light."""
    pointer = f"/lights/{emitter.number}"
    effect = f"lights.{request.document.lights[emitter.number].type}"
    detail = f"{emitter.count} {emitter.pattern} points" if emitter.count > 1 else "one point"
    request.list_stage(f"points of light {emitter.number}", effect, detail, (pointer,), COSTS.faced)
    shadows = _shadows(request, emitter)
    weights = _weights(request, emitter, pointer)
    terms = _terms(request, emitter, pointer)
    return Lighting(emitter, tuple(shadows), tuple(weights), tuple(terms), request.dtype)


def visibility(request: Request) -> tuple[Lighting, ...]:
    """Every light with its shadow casters."""
    seen = [emitter_of(request, number) for number in range(len(request.document.lights))]
    return tuple(
        Lighting(emitter, tuple(shadow_stages(request, emitter)), (), (), request.dtype) for emitter in seen
    )


def _shadows(request: Request, emitter: Emitter) -> list[LightStage]:
    """Shadow rays of a light against every family, unless there is only one shape."""
    pointer = f"/lights/{emitter.number}"
    if _shades_nothing(request):
        request.leave_out("shadow rays", "a single convex shape has nothing to cast its shadow on", pointer)
        return []
    stages = shadow_stages(request, emitter)
    for family in request.families:
        name, detail = f"shadows of {family.plural}", f"shadow rays from points to light {emitter.number}"
        each = _shading(family, emitter.count, request.crowds[family.kind])
        request.list_stage(name, f"shapes.{family.kind}", detail, (pointer,), each)
    return stages


def _shading(family: Family, light_points: int, crowd: float) -> float:
    """Nanoseconds a point."""
    if in_tree(family):
        return cost.shaded_by_tree(family.numbers.size, light_points)
    return light_points * COSTS.shadow * min(2.0, family.numbers.size / 4) + COSTS.crowd_shadow * crowd


def _shades_nothing(request: Request) -> bool:
    """Whether a scene needs no shadows: a single shape that cannot shade itself.

    Some point of a lens may be inside although its middle is not, and rays pass through glass.
    """
    if transparent(request):
        return False
    if sum(family.numbers.size for family in request.families) > 1:
        return False
    camera = request.document.camera
    viewer = None if camera.lens_radius > 0 else column(camera.position)
    return not any(family.shades_itself(viewer) for family in request.families)


def shadow_stages(request: Request, emitter: Emitter) -> list[LightStage]:
    """The stages that mark the light points which families of shapes block."""
    return [
        stage
        for family in request.families
        for stage in occluder_of(family)(family, emitter, request.dtype, request.culling)
    ]


def _weights(request: Request, emitter: Emitter, pointer: str) -> list[LightStage]:
    """Weights that the light asks for."""
    light = request.document.lights[emitter.number]
    weights = [weight for weight in LIGHTS[type(light)].weights if not weight.asked or weight.asked(light)]
    for weight in weights:
        name, each = f"{weight.name} of light {emitter.number}", COSTS.falloff * emitter.count
        asking = (f"{pointer}/{weight.field}" if weight.field in light.model_fields_set else pointer,)
        request.list_stage(name, f"lights.{weight.name}", weight.detail, asking, each)
    return [weight.build(light) for weight in weights]


def _terms(request: Request, emitter: Emitter, pointer: str) -> list[LightTerm]:
    """Terms of the light, for the materials of each kind."""
    found: list[LightTerm] = []
    costs = {"diffuse": COSTS.diffuse, "specular": COSTS.highlight}
    for kind, name in {type(material): material.type for material in request.materials}.items():
        for term in MATERIALS[kind].terms(request.materials, request.dtype):
            asking = request.material_pointers(np.flatnonzero(term.used))
            each = costs[term.stage.adds] * emitter.count * term.share
            request.list_stage(term.name, f"materials.{name}", term.detail, (pointer, *asking), each)
            if term.viewed:
                request.reads.add("viewers")
            found.append(term.stage)
    return found
