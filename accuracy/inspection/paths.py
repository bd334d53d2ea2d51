"""The tree of rays of a pixel: the ray through its middle, and the rays scattered from its hits."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from accuracy.inspection.lighting import lights_at
from renderer.integrator import camera_rays, intersect, successors
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats
from renderer.plan.building import compile_visibility, with_coordinates
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Lighting
from renderer.tiling import Block
from renderer.waves import BOUNCES, Wave, camera_wave
from schemas.api.inspections import InspectedLight
from schemas.tiles import Pass

MOST_RAYS = 256
"""Rays reported of a tree: between mirrors and in glass there may be thousands, too many to read."""

ONE_RAY = Pass(index=1, stride=1, first=0, last=1)


@dataclass(slots=True, eq=False)
class Leg:
    """One ray of a path, and its hit.

    Attributes
    ----------
    kind : str
        `camera`, or one of `waves.BOUNCES`.
    wave : Wave
        Of this one ray.
    points : Points
        Its hit, or none.
    radiance, ambient : (3,) float64
        Of its hit, and the ambient part of it.
    lights : tuple of InspectedLight
        All lights of the scene, if it hits a shape.
    legs : list of Leg
        The rays scattered from its hit.
    """

    kind: str
    wave: Wave
    points: Points
    radiance: Floats
    ambient: Floats
    lights: tuple[InspectedLight, ...]
    legs: list["Leg"] = field(default_factory=list)


def ray_of(plan: RenderPlan, x: int, y: int) -> Rays:
    """The ray through the middle of the pixel in column x and row y."""
    return camera_rays(plan, Block(np.array([x]), np.array([y]), (x, y, x + 1, y + 1)), ONE_RAY)


def walk(plan: RenderPlan, x: int, y: int) -> tuple[Leg, bool]:
    """Follow the ray of a pixel; also say whether the tree is complete. Short paths come first."""
    lights, plan = compile_visibility(plan), with_coordinates(plan)
    root = _followed(plan, lights, "camera", camera_wave(ray_of(plan, x, y)))
    waiting, count = deque([root]), 1
    while waiting:
        leg = waiting.popleft()
        for kind, wave in _scattered(plan, leg):
            if count == MOST_RAYS:
                return root, False
            leg.legs.append(_followed(plan, lights, kind, wave))
            count += 1
        waiting.extend(leg.legs)
    return root, True


def _scattered(plan: RenderPlan, leg: Leg) -> list[tuple[str, Wave]]:
    waves = successors(plan, leg.points, leg.wave)
    return [(BOUNCES[wave.kinds[i]], wave.part(np.array([i]))) for wave in waves for i in range(wave.size)]


def _followed(plan: RenderPlan, lights: tuple[Lighting, ...], kind: str, wave: Wave) -> Leg:
    points = intersect(plan, wave.rays)
    if not points.count:
        seen = plan.unshaded.radiance(wave.rays.shapes)[:, 0]
        return Leg(kind, wave, points, seen, np.zeros(3), ())
    ambient = points.radiance[:, 0].copy()
    inspected = lights_at(plan, lights, points)
    radiance = ambient + sum((np.add(light.diffuse, light.specular) for light in inspected), np.zeros(3))
    return Leg(kind, wave, points, radiance, ambient, inspected)
