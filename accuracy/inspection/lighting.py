"""What each light of a scene is to one point: how much of it is seen, what hides the rest, what it adds."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from renderer.integrator import find_hits, workspace
from renderer.interaction import Points, Rays
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.materials.phong import Diffuse, Highlight
from renderer.math.arrays import Floats, Integers, Masks, dot, unit
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Illumination, Lighting
from renderer.self_intersection import OriginSurfaces

TERMS: dict[type, str] = {Diffuse: "diffuse", Highlight: "specular"}
"""Stages of a light that add to radiance, by the name of what they add."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenLight:
    """One light as one point sees it.

    Attributes
    ----------
    number : int
        Place in the scene's list of lights.
    points, below, blocked : int
        Its points: all, those behind the surface, and those with a shape in the way.
    blockers : tuple of (int, int)
        Shapes that are first in the way, and of how many points, most first.
    cosine : float
        Between shading normal and the direction to the light's middle.
    turned_away : bool
        Whether it shines to one side only, and the point is on the other.
    terms : dict of str to (3,) float64
        Radiance by the names of `TERMS`; those that nothing asked for are missing.
    """

    number: int
    points: int
    below: int
    blocked: int
    blockers: tuple[tuple[int, int], ...]
    cosine: float
    turned_away: bool
    terms: dict[str, Floats]


def lights_at(plan: RenderPlan, lights: tuple[Lighting, ...], point: Points) -> list[SeenLight]:
    """All lights of a scene, `lights` as `compile_visibility` gives them, seen from one point."""
    shining = {lighting.emitter.number: lighting for lighting in plan.lightings}
    return [_seen(plan, light, shining.get(light.emitter.number), point) for light in lights]


def _seen(plan: RenderPlan, light: Lighting, shining: Illumination | None, point: Points) -> SeenLight:
    emitter = light.emitter
    above, blocked, blockers = _in_the_way(plan, light, point)
    towards = emitter.towards(point.positions)
    return SeenLight(
        number=emitter.number,
        points=emitter.count,
        below=emitter.count - int(np.count_nonzero(above)),
        blocked=int(np.count_nonzero(blocked)),
        blockers=blockers,
        cosine=float(dot(point.shading_normals, unit(towards)).item()),
        turned_away=emitter.one_sided and dot(towards, emitter.normal).item() >= 0,
        terms=_terms(shining, point) if isinstance(shining, Lighting) else {},
    )


def _in_the_way(
    plan: RenderPlan, light: Lighting, point: Points
) -> tuple[Masks, Masks, tuple[tuple[int, int], ...]]:
    """Light points (L,) above the horizon, those of them that are blocked, and by which shapes."""
    view = light.view(point, workspace())
    if not view.count:
        nothing = np.zeros(light.emitter.count, dtype=bool)
        return nothing, nothing, ()
    above = view.above_horizon(point.normals)[:, 0]
    blocked = np.zeros_like(above) if view.blocked is None else view.blocked[:, 0] & above
    first = _first_hit(plan, light.emitter, point, _directions(view, np.flatnonzero(blocked)))
    return above, blocked, tuple(Counter(first).most_common())


def _directions(view: LightView, hidden: Integers) -> Floats:
    """From the one point of a view to some of its light points, (3, m)."""
    u, v = (places[hidden, 0] for places in view.light_points.places(np.arange(1)))
    return view.towards + view.emitter.first * u + view.emitter.second * v


def _first_hit(plan: RenderPlan, emitter: Emitter, point: Points, directions: Floats) -> list[int]:
    """Shapes that rays from a point along `directions` (3, m) hit first, before the light."""
    rays = Rays(
        origins=point.positions,
        directions=directions,
        pixels=np.repeat(point.pixels, directions.shape[1]),
        samples=np.repeat(point.samples, directions.shape[1]),
        origin_surfaces=_origin_surfaces(point, directions.shape[1]),
    )
    find_hits(plan, rays, lights=False)
    between = rays.t <= 1.0 if emitter.weight else np.isfinite(rays.t)
    shapes: list[int] = rays.shapes[between].tolist()
    return shapes


def _origin_surfaces(point: Points, count: int) -> OriginSurfaces:
    """Rays that leave a point to the side it is seen from."""
    return OriginSurfaces(
        shapes=np.repeat(point.shapes, count),
        primitives=np.repeat(point.primitives, count),
        outside=np.repeat(~point.flipped, count),
        sizes=np.repeat(point.sizes, count),
        previous_origins=point.previous_origins,
        paths=np.repeat(point.paths, count),
        path_lengths=np.repeat(point.path_lengths, count),
    )


def _terms(lighting: Lighting, point: Points) -> dict[str, Floats]:
    """What the terms of a light add to the radiance of a point, one by one; sets that radiance to 0."""
    view = lighting.view(point, workspace())
    view.drop_dark()
    added: dict[str, Floats] = {}
    for term in lighting.terms if view.count else ():
        point.radiance[...] = 0.0
        term.run(view)
        name = TERMS.get(type(term))
        if name is not None:
            added[name] = added.get(name, np.zeros(3)) + point.radiance[:, 0]
    point.radiance[...] = 0.0
    return added
