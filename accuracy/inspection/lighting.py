"""Contribution of each light to one point: its visible share, its occluders and its radiance."""

from collections import Counter
from dataclasses import replace
from typing import cast

import numpy as np

from renderer.integrator import find_hits, workspace
from renderer.interaction import Points, Rays
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks, dot, lengths, unit
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Illumination, Lighting
from schemas.api.inspections import Blocker, InspectedLight, Triple
from schemas.pointers import pointer


def lights_at(plan: RenderPlan, lights: tuple[Lighting, ...], point: Points) -> tuple[InspectedLight, ...]:
    """All lights of a scene, `lights` as `compile_visibility` gives them, seen from one point."""
    shining = {lighting.emitter.number: lighting for lighting in plan.lightings}
    return tuple(_seen(plan, light, shining.get(light.emitter.number), point) for light in lights)


def triple(values: Floats) -> Triple:
    """Three numbers of an array as Python floats."""
    return cast("Triple", tuple(values.tolist()))


def _seen(plan: RenderPlan, light: Lighting, shining: Illumination | None, point: Points) -> InspectedLight:
    emitter = light.emitter
    above, blocked, blockers = _in_the_way(plan, light, point)
    below, hidden = emitter.count - int(np.count_nonzero(above)), int(np.count_nonzero(blocked))
    towards = emitter.towards(point.positions)
    added = _terms(shining, point) if isinstance(shining, Lighting) else {}
    unblocked = _terms(shining, point, shadows=False) if isinstance(shining, Lighting) else {}
    return InspectedLight(
        light=emitter.number,
        pointer=pointer(["lights", emitter.number]),
        visibility=(emitter.count - below - hidden) / emitter.count,
        points=emitter.count,
        below_horizon=below,
        blocked=hidden,
        blockers=tuple(_blocker(plan, number, count) for number, count in blockers.most_common()),
        cosine=float(dot(point.shading_normals, unit(towards)).item()),
        turned_away=_is_turned_away(emitter, towards),
        diffuse=triple(added.get("diffuse", np.zeros(3))),
        specular=triple(added.get("specular", np.zeros(3))),
        unblocked=triple(sum(unblocked.values(), np.zeros(3))),
    )


def _is_turned_away(emitter: Emitter, towards: Floats) -> bool:
    """Whether a light shines to the other side, or into a cone that does not reach the point."""
    if emitter.least_cosine is None:
        return False
    return -dot(towards, emitter.normal).item() <= emitter.least_cosine * lengths(towards).item()


def _blocker(plan: RenderPlan, number: int, points: int) -> Blocker:
    name = plan.document.shapes[number].name
    return Blocker(pointer=pointer(["shapes", number]), name=name, shape=number, points=points)


def _in_the_way(plan: RenderPlan, light: Lighting, point: Points) -> tuple[Masks, Masks, Counter[int]]:
    """Masks (L,) of light points above the horizon and of blocked ones; and counts by blocking shape."""
    view = light.view(point, workspace())
    if not view.count:
        nothing = np.zeros(light.emitter.count, dtype=bool)
        return nothing, nothing, Counter()
    above = view.above_horizon(point.normals)[:, 0]
    blocked = np.zeros_like(above) if view.blocked is None else view.blocked[:, 0] & above
    first = _first_hit(plan, light.emitter, point, _directions(view, np.flatnonzero(blocked)))
    return above, blocked, Counter(first)


def _directions(view: LightView, hidden: Integers) -> Floats:
    """Vectors from the point of a view to some of its light points, (3, m)."""
    u, v = (places[hidden, 0] for places in view.light_points.places(np.arange(1)))
    return view.towards + view.emitter.first * u + view.emitter.second * v


def _first_hit(plan: RenderPlan, emitter: Emitter, point: Points, directions: Floats) -> list[int]:
    """Shapes that rays from a point along `directions` (3, m) hit first, before the light."""
    rays = Rays(
        origins=point.positions,
        directions=directions,
        pixels=np.repeat(point.pixels, directions.shape[1]),
        samples=np.repeat(point.samples, directions.shape[1]),
        origin_surfaces=point.origin_surfaces(np.zeros(directions.shape[1], dtype=np.int64)),
    )
    find_hits(plan, rays, lights=False)
    between = rays.t <= 1.0 if emitter.weight else np.isfinite(rays.t)
    shapes: list[int] = rays.shapes[between].tolist()
    return shapes


def _terms(lighting: Lighting, point: Points, *, shadows: bool = True) -> dict[str, Floats]:
    """Contribution of each term of a light to the radiance of a point, which is reset to 0."""
    view = (lighting if shadows else replace(lighting, shadows=())).view(point, workspace())
    view.drop_dark()
    added: dict[str, Floats] = {}
    for weight in lighting.weights if view.count else ():
        weight.run(view)
    for term in lighting.terms if view.count else ():
        point.radiance[...] = 0.0
        term.run(view)
        added[term.adds] = added.get(term.adds, np.zeros(3)) + point.radiance[:, 0]
    point.radiance[...] = 0.0
    return added
