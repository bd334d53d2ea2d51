"""Rays of one kind and depth, and how much of what they see reaches the camera."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, Integers, Masks, lengths
from renderer.math.streams import branch
from renderer.self_intersection import OriginSurfaces

KINDS = ("mirror", "reflection", "refraction")
"""Ways in which a path continues; the place of each names its random numbers."""

COUNTED_AS = {"mirror": "mirror", "reflection": "transmission", "refraction": "transmission"}
"""The kind of ray that the report counts each as."""


@dataclass(frozen=True, slots=True, eq=False)
class Wave:
    """Rays (N,) that have bounced equally often, and alike.

    Attributes
    ----------
    count_as : str
        Kind of rays in the report: camera, mirror or transmission.
    rays : Rays
    weights : (N,) float64
        Share of their radiance that reaches the camera.
    targets : (N,) int64
        Which camera ray each belongs to.
    depth : int
        Bounces so far.
    """

    count_as: str
    rays: Rays
    weights: Floats
    targets: Integers
    depth: int


def camera_wave(rays: Rays) -> Wave:
    """Rays from the camera."""
    count = rays.t.size
    return Wave("camera", rays, np.ones(count), np.arange(count), 0)


def leaving(
    wave: Wave,
    points: Points,
    chosen: Integers,
    directions: Floats,
    shares: Floats,
    outside: Masks,
    kind: str,
    faintest: float,
) -> tuple[Wave, ...]:
    """Rays from some of the points that a wave has hit, without those that no picture shows.

    Parameters
    ----------
    wave : Wave
    points : Points
    chosen : (M,) int64
        Which of the points.
    directions : (3, M) float64
    shares : (M,) float64
        Of the rays' weights.
    outside : (M,) bool
        Whether the new rays go to the outward side.
    kind : str
        One of `KINDS`.
    faintest : float
        Paths up to this weight end; 0 for those alone that add nothing.
    """
    weights = wave.weights[points.rays[chosen]] * shares
    bright = np.flatnonzero(weights > faintest)
    if not bright.size:
        return ()
    start = chosen[bright]
    surfaces = OriginSurfaces(
        shapes=points.shapes[start],
        primitives=points.primitives[start],
        outside=outside[bright],
        sizes=points.sizes[start],
        previous_origins=_previous_origins(points, start, outside[bright]),
        paths=branch(points.paths[start], KINDS.index(kind)),
        path_lengths=points.path_lengths[start] + points.t[start] * lengths(points.directions[:, start]),
    )
    rays = Rays(
        origins=points.positions[:, start],
        directions=directions[:, bright],
        pixels=points.pixels[start],
        samples=points.samples[start],
        origin_surfaces=surfaces,
    )
    return (Wave(COUNTED_AS[kind], rays, weights[bright], wave.targets[points.rays[start]], wave.depth + 1),)


def _previous_origins(points: Points, start: Integers, outside: Masks) -> Floats:
    """Where the rays before those that leave points `start` (M,) came from, (3, 1) or (3, M).

    A ray that enters at an edge of glass may hit the face beside it at once. When it has passed both, it is
    on no side of either, and hits them no more.
    """
    previous = points.previous_origins_at(start)
    if points.previous_origins is points.origins:
        return previous
    passing = outside == points.flipped[start]
    return np.where(points.went_nowhere(start) & passing, points.positions[:, start], previous)
