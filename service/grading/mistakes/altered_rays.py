"""Wrong camera rays: axes of other lengths or angles, wrong screens, and not the nearest of a ray's hits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from renderer.cameras import Pinhole, build_pinhole, upward
from renderer.interaction import MISS, Rays, RayStage
from renderer.math.arrays import Integers, cross, dot, taken, unit
from renderer.plan.plan import RenderPlan
from schemas.cameras import Camera
from schemas.scene import Scene
from service.grading.displacements import STRETCHED, DisplacedPinhole

Change = Callable[[RenderPlan], RenderPlan]
"""Makes a mistake in the plan of a scene."""

Refit = Callable[[Pinhole], Pinhole]

MOST_LAYERS = 64
"""Most surfaces behind each other that are looked through."""

BEYOND = 2.0**-30
"""A ray continues behind a hit by this share of its distance, many roundings and less than any detail."""


@dataclass(frozen=True, slots=True)
class Unbounded:
    """Stage: rays of which nothing is known beforehand, so that every shape is tried.

    Bounds of shapes on the screen are those of the right camera.
    """

    def run(self, rays: Rays) -> None:
        """Forget the bounds."""
        rays.screen = None


def altered_cameras(document: Scene) -> Iterator[tuple[str, Change]]:
    """Causes, and the changes of plans that make these mistakes."""
    camera = document.camera
    for cause, refit in (*_screens(camera), *_axes(camera)):
        yield cause, partial(_with_camera, refit)


def _with_camera(refit: Refit, plan: RenderPlan) -> RenderPlan:
    return replace(plan, camera=refit(plan.camera), intersectors=(Unbounded(), *plan.intersectors))


def _screens(camera: Camera) -> Iterator[tuple[str, Refit]]:
    if camera.width != camera.height:
        yield "aspect_ignored", lambda right: replace(right, half_width=right.half_height)
    if min(camera.width, camera.height) > 1 and not camera.lens_radius:
        for wrong in STRETCHED:
            yield wrong.cause, partial(DisplacedPinhole.of, wrong, camera.width, camera.height)


def _axes(camera: Camera) -> Iterator[tuple[str, Refit]]:
    forward, up = build_pinhole(camera).forward, upward(camera)
    length = float(np.sqrt(np.sum(cross(forward, up) ** 2)))
    if not np.isclose(length, 1):
        yield "camera_axes_not_unit", partial(_scaled, length, length)
        yield "camera_axes_not_unit", partial(_scaled, length, 1.0)
    if not np.isclose(dot(forward, unit(up)).item(), 0):
        yield "camera_axes_not_orthogonal", lambda right: replace(right, up=unit(up))


def _scaled(across: float, upwards: float, right: Pinhole) -> Pinhole:
    return replace(right, right=across * right.right, up=upwards * right.up)


@dataclass(frozen=True, slots=True)
class LastHit:
    """Stage: the shape with the highest number that a camera ray hits, at the nearest of its hits.

    Its stages find nearest hits.
    """

    stages: tuple[RayStage, ...]

    def run(self, rays: Rays) -> None:
        """Look through one surface after the other."""
        if rays.origin_surfaces is not None:
            self._nearest(rays)
            return
        index, begun = np.arange(rays.t.size), np.zeros(rays.t.size)
        for _ in range(MOST_LAYERS):
            part = _continued(rays, index, begun)
            self._nearest(part)
            hit = np.flatnonzero(part.shapes != MISS)
            if not hit.size:
                return
            index, begun = index[hit], begun[hit] + part.t[hit]
            _take_later(rays, index, begun, part, hit)
            begun = begun * (1 + BEYOND)

    def _nearest(self, rays: Rays) -> None:
        for stage in self.stages:
            stage.run(rays)


def _continued(rays: Rays, index: Integers, begun: np.ndarray) -> Rays:
    """Some of the rays, from distances `begun` on."""
    directions = taken(rays.directions, index)
    return Rays(
        origins=rays.origins_at(index) + begun * directions,
        directions=directions,
        pixels=rays.pixels[index],
        samples=rays.samples[index],
    )


def _take_later(rays: Rays, index: Integers, t: np.ndarray, part: Rays, hit: Integers) -> None:
    """Take the hits with shapes of higher numbers than those known."""
    later = part.shapes[hit] > rays.shapes[index]
    chosen, source = index[later], hit[later]
    rays.t[chosen] = t[later]
    rays.shapes[chosen], rays.primitives[chosen] = part.shapes[source], part.primitives[source]
    rays.coordinates[:, chosen] = part.coordinates[:, source]


def with_last_hits(plan: RenderPlan) -> RenderPlan:
    """The plan of a program that draws the last shape that it finds on a ray."""
    return replace(plan, intersectors=(LastHit(plan.intersectors),))
