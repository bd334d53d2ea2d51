"""Intersections in the wrong order: the last shape of the scene that a ray hits, not the nearest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from renderer.interaction import MISS, Rays, RayStage
from renderer.math.arrays import Integers, taken
from renderer.plan.plan import RenderPlan

MOST_LAYERS = 64
"""Most surfaces behind each other that are looked through."""

BEYOND = 2.0**-30
"""A ray continues behind a hit by this share of its distance, many roundings and less than any detail."""


@dataclass(frozen=True, slots=True)
class LastHit:
    """Stage: the shape with the highest number that a camera ray hits, at the nearest of its hits.

    Attributes
    ----------
    stages : tuple of RayStage
        They find nearest hits.
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
