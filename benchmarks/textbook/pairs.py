"""What pairs of a point and a light point need: where the points stand, and the ways to the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.single import SINGLE, STEP, Singles, buffer
from renderer.lights.emitters import Emitter
from renderer.lights.samples import Grid, LightPoints

if TYPE_CHECKING:
    from renderer.interaction import Points
    from renderer.lights.view import LightView
    from renderer.math.arrays import Integers
    from renderer.math.streams import Keys

FORMED = ("positions", "normals", "colors", "radiance", "coordinates")
"""What the stages of a picture without bent normals fill in."""


@dataclass(frozen=True, slots=True)
class InSingle:
    """Stage before all others: room in float32 for what they fill in."""

    def run(self, points: Points) -> None:
        """Take the place of what is there for float64."""
        points.t, points.hits = points.t.astype(SINGLE), points.hits.astype(SINGLE)
        for name in FORMED:
            setattr(points, name, np.zeros(getattr(points, name).shape, SINGLE))
        points.shading_normals = points.normals


@dataclass(frozen=True, slots=True, eq=False)
class SingleEmitter(Emitter):
    """A light whose vectors are float32."""

    def points(
        self, pixels: Integers, samples: Integers, paths: Keys, dtype: np.dtype[np.floating]
    ) -> LightPoints:
        """The light points of the renderer; those of a grid in float32."""
        points = Emitter.points(self, pixels, samples, paths, dtype)
        if isinstance(points, Grid):
            points.u, points.v = points.u.astype(SINGLE), points.v.astype(SINGLE)
        return points


def stepped(positions: Singles, normals: Singles) -> Singles:
    """Places (3, n) off their surfaces by a step."""
    return positions + SINGLE.type(STEP) * normals


def starts(view: LightView) -> Singles:
    """Where the shadow rays of the points begin, (3, n)."""
    return stepped(view.of_points(view.points.positions), view.of_points(view.points.normals))


def light_places(view: LightView, index: Integers | None = None) -> Singles:
    """The light points of some of the points, (3, L, 1) where all share them, else (3, L, n)."""
    emitter, index = view.emitter, np.arange(view.count) if index is None else index
    u, v = (place.astype(SINGLE) for place in view.light_points.places(index))
    return np.stack([emitter.centre[i] + u * emitter.first[i] + v * emitter.second[i] for i in range(3)])


def ways(places: Singles, lights: Singles) -> list[Singles]:
    """From places (3, n) to light points (3, L, 1) or (3, L, n): three buffers (L, n)."""
    shape = lights.shape[1], places.shape[1]
    return [
        np.subtract(light, place, out=buffer(f"way {axis}", *shape))
        for axis, (light, place) in enumerate(zip(lights, places, strict=True))
    ]
