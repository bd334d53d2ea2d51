"""Hits of given rays, and the visibility of each light from them."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments import check_plan
from renderer.integrator import intersect, shade
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, Integers, vectors
from renderer.math.numerics import finite
from renderer.plan.building import compile_visibility, with_coordinates
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Lighting
from renderer.tiling import BLOCK_RAYS
from renderer.workspace import Workspace
from schemas.quantities import LONGEST, MAX_ORIGIN, SHORTEST


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """Hits of N rays.

    Attributes
    ----------
    t : (N,) float64
        Distance in units of the direction given, whatever its length; inf for a miss.
    position, normal : (N, 3) float64
        The point, and the geometric unit normal on the side the ray came from; NaN for a miss.
    uv : (N, 2) float64
        Texture coordinates; NaN for a miss.
    shape : (N,) int64
        Index into the scene's shapes, -1 for a miss.
    primitive : (N,) int64
        Triangle within a mesh, else 0.
    visibility : (N, lights) float64
        Share of each light's points that are seen from the hit, 0 to 1; 0 for a miss.
    """

    t: Floats
    position: Floats
    normal: Floats
    uv: Floats
    shape: NDArray[np.int64]
    primitive: NDArray[np.int64]
    visibility: Floats


def trace(plan: RenderPlan, origins: ArrayLike, directions: ArrayLike) -> Hits:
    """Nearest hits of rays with the shapes of a scene, and the visibility of its lights from there.

    Parameters
    ----------
    plan : RenderPlan
    origins, directions : (N, 3) array_like of real numbers, taken as float64
        Coordinates of origins may be up to 1e30, the largest component of a direction 1e-200 to 1e200. A ray
        that is not finite, or whose direction is 0, misses.

    Returns
    -------
    Hits
        Light points are those of the scene's light sampling, for pixel number 0 .. N-1 and sample 0. A light
        point below the horizon of the surface is not seen.

    Raises
    ------
    TypeError
        If `plan` is not a plan.
    ValueError
        If an array does not have the shape (N, 3) or does not hold real numbers, the two differ in N, or a
        number is beyond these bounds.
    """
    check_plan(plan, "trace")
    start, along = (
        np.ascontiguousarray(vectors(name, given).T)
        for name, given in (("origins", origins), ("directions", directions))
    )
    if start.shape != along.shape:
        raise ValueError(
            f"origins have {start.shape[1]} rows and directions {along.shape[1]}; the numbers must be equal."
        )
    usable = np.flatnonzero(finite(start) & finite(along) & (along != 0).any(axis=0))
    _refuse_beyond("origins", start, usable, (0.0, MAX_ORIGIN), "Start the ray nearer to the scene.")
    _refuse_beyond("directions", along, usable, (SHORTEST, LONGEST), "Multiply it by any number.")
    hits = _misses(start.shape[1], len(plan.document.lights))
    lights, plan = compile_visibility(plan), with_coordinates(plan)
    for first in range(0, usable.size, BLOCK_RAYS):
        _trace_block(plan, lights, start, along, usable[first : first + BLOCK_RAYS], hits)
    return hits


def _refuse_beyond(name: str, rows: Floats, usable: Integers, bounds: tuple[float, float], cure: str) -> None:
    least, most = bounds
    largest = np.abs(rows[:, usable]).max(axis=0)
    wrong = usable[(largest < least) | (largest > most)]
    if wrong.size:
        place = f"The largest component in row {wrong[0]} of '{name}'"
        raise ValueError(f"{place} must be between {least:g} and {most:g}. {cure}")


def _misses(count: int, lights: int) -> Hits:
    return Hits(
        t=np.full(count, np.inf),
        position=np.full((count, 3), np.nan),
        normal=np.full((count, 3), np.nan),
        uv=np.full((count, 2), np.nan),
        shape=np.full(count, -1, dtype=np.int64),
        primitive=np.zeros(count, dtype=np.int64),
        visibility=np.zeros((count, lights)),
    )


def _trace_block(
    plan: RenderPlan,
    lights: tuple[Lighting, ...],
    origins: Floats,
    directions: Floats,
    block: Integers,
    hits: Hits,
) -> None:
    # Scaling by a power of two is exact, and keeps products of very long or short directions in range.
    along = directions[:, block]
    _, exponents = np.frexp(np.abs(along).max(axis=0))
    rays = Rays(origins[:, block], np.ldexp(along, -exponents), block, np.zeros_like(block))
    points = intersect(plan, rays, lights=False)
    found = block[points.rays]
    hits.t[found] = np.ldexp(points.t, -exponents[points.rays])
    hits.position[found] = points.positions.T
    hits.normal[found] = points.normals.T
    hits.uv[found] = points.coordinates.T
    hits.shape[found] = points.shapes
    hits.primitive[found] = points.primitives
    pairs = zip(lights, hits.visibility.T, strict=True)
    shade(plan, points, [partial(_fill_shares, light, seen, block) for light, seen in pairs])


def _fill_shares(light: Lighting, seen: Floats, block: Integers, points: Points, workspace: Workspace) -> int:
    """Fill `seen` (N,) with the share of a light's points that is seen from some hits of rays `block`."""
    view = light.view(points, workspace)
    if view.count:
        visible = view.above_horizon(view.of_points(points.normals))
        if view.blocked is not None:
            visible &= ~view.blocked
        seen[block[points.rays[view.chosen]]] = visible.mean(axis=0)
    return view.count * view.light_points.count
