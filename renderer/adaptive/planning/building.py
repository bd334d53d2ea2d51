"""A plan of samples becomes one of target quality."""

from dataclasses import replace
from functools import partial

import numpy as np

from renderer.accelerators.trees import in_tree
from renderer.adaptive.edges import edge_places
from renderer.adaptive.lattice import stride_for
from renderer.adaptive.outlines import SharedEdges
from renderer.adaptive.outlines import thin_places as thin_outlines
from renderer.adaptive.planning import details, explanations, pilots
from renderer.adaptive.policies import PilotSamples, SampledLattice
from renderer.adaptive.thin import narrow_places, thin_places
from renderer.adaptive.touched import touched_places
from renderer.math.arrays import Integers
from renderer.plan.plan import AdaptivePlan, Policy, RenderPlan
from renderer.plan.request import Request
from schemas.quality import TargetQuality


def adapted(plan: RenderPlan, request: Request, target: TargetQuality) -> RenderPlan:
    """The plan of the samples of a request, with what target quality needs beside it."""
    if request.document.camera.lens_radius > 0:
        policy = SampledLattice()
        adaptive = _adaptive(request, policy, _places_through_lens(plan, request, policy))
        return replace(plan, adaptive=adaptive, entries=explanations.with_lattice(plan, policy))
    target = pilots.in_time(target)
    seen = pilots.request_of(request, target, details.materials(request, plan.lightings))
    places = _places(plan, seen)
    # The same shapes and the same camera: what is formed of them for its rays serves both.
    pilot = replace(pilots.build_pilot(seen, target), intersectors=plan.intersectors)
    entries = (*pilot.entries, *explanations.shadow_edges(request, places["shadow_edges"]))
    adaptive = _adaptive(seen, PilotSamples(), places)
    return replace(plan, adaptive=replace(adaptive, pilot=replace(pilot, entries=entries)))


def _adaptive(seen: Request, policy: Policy, places: dict[str, Integers]) -> AdaptivePlan:
    """All but the pilot; `seen` is the request of what shows first of a pixel."""
    detailed = pilots.detailed(seen)
    return AdaptivePlan(
        policy=policy,
        pilot=None,
        textured=pilots.shapes_with(seen, "color_texture") | detailed,
        averaged=pilots.averaged_shapes(seen),
        detailed=detailed,
        needs_sampling=pilots.shapes_with(seen, "normal_map", "bump_map", "mirror", "transmission"),
        glints=pilots.glints(seen),
        **places,
    )


def _places(plan: RenderPlan, seen: Request) -> dict[str, Integers]:
    """Fields of an `AdaptivePlan` that name pixels to look at."""
    camera = plan.camera
    within = stride_for(camera.width, camera.height)
    trees = [SharedEdges.of(family.numbers, family.vertices) for family in seen.families if in_tree(family)]
    thin = [thin_outlines(camera, tree.outline(camera.position), within).pixels for tree in trees]
    visible = [light.rectangles for light in plan.visible_lights]
    return {
        "thin": np.hstack([pilots.places([*seen.families, *visible], partial(thin_places, camera)), *thin]),
        "narrow": pilots.places(seen.families, partial(narrow_places, camera)),
        "edges": np.hstack([pilots.places([*seen.families, *visible], partial(edge_places, camera)), *thin]),
        "lamps": pilots.places(visible, partial(edge_places, camera)),
        "shadow_edges": pilots.shadow_places(plan, trees),
    }


def _places_through_lens(plan: RenderPlan, seen: Request, policy: SampledLattice) -> dict[str, Integers]:
    """The same through a lens, where only small and thin shapes are looked for."""
    families = [*seen.families, *(light.rectangles for light in plan.visible_lights)]
    none = np.zeros((2, 0), dtype=np.int64)
    within = policy.first_stride(plan.width, plan.height)
    return {
        "thin": touched_places(plan.camera, families, within),
        "narrow": none,
        "edges": none,
        "lamps": none,
        "shadow_edges": np.zeros((3, 0), dtype=np.int64),
    }
