"""A plan of samples becomes one of target quality."""

from dataclasses import replace
from functools import partial

import numpy as np

from renderer.adaptive.edges import edge_places
from renderer.adaptive.planning import details, explanations, pilots
from renderer.adaptive.policies import PilotSamples, SampledLattice
from renderer.adaptive.thin import narrow_places, thin_places
from renderer.math.arrays import Integers
from renderer.plan.plan import AdaptivePlan, Policy, RenderPlan
from renderer.plan.request import Request
from schemas.quality import TargetQuality


def adapted(plan: RenderPlan, request: Request, target: TargetQuality) -> RenderPlan:
    """The plan of the samples of a request, with what target quality needs beside it."""
    if request.document.camera.lens_radius > 0:
        policy = SampledLattice()
        adaptive = _adaptive(plan, request, policy, np.zeros((3, 0), dtype=np.int64))
        return replace(plan, adaptive=adaptive, entries=explanations.with_lattice(plan, policy))
    places = pilots.shadow_places(plan)
    target = pilots.in_time(target)
    seen = pilots.request_of(request, target, details.materials(request, plan.lightings))
    # The same shapes and the same camera: what is formed of them for its rays serves both.
    pilot = replace(pilots.build_pilot(seen, target), intersectors=plan.intersectors)
    pilot = replace(pilot, entries=(*pilot.entries, *explanations.shadow_edges(request, places)))
    adaptive = _adaptive(plan, seen, PilotSamples(), places)
    return replace(plan, adaptive=replace(adaptive, pilot=pilot))


def _adaptive(plan: RenderPlan, seen: Request, policy: Policy, shadow_edges: Integers) -> AdaptivePlan:
    """All but the pilot; `seen` is the request of what shows first of a pixel."""
    visible = [light.rectangles for light in plan.visible_lights]
    detailed = pilots.detailed(seen)
    return AdaptivePlan(
        policy=policy,
        pilot=None,
        textured=pilots.shapes_with(seen, "color_texture") | detailed,
        averaged=pilots.averaged_shapes(seen),
        detailed=detailed,
        needs_sampling=pilots.shapes_with(seen, "normal_map", "bump_map", "mirror", "transmission"),
        thin=pilots.places(seen.families, partial(thin_places, plan.camera)),
        narrow=pilots.places(seen.families, partial(narrow_places, plan.camera)),
        edges=pilots.places([*seen.families, *visible], partial(edge_places, plan.camera)),
        shadow_edges=shadow_edges,
    )
