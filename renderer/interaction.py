"""Rays of one block, what they hit, and the points to be shaded."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats, Integers, Masks, put, taken, unit
from renderer.math.streams import Keys
from renderer.self_intersection import OriginSurfaces

MISS = -1
"""Shape number of a ray that hits nothing."""

EMITTER = 1 << 40
"""Shape numbers from here on name lights that the camera sees."""


@dataclass(slots=True, eq=False)
class Rays:
    """Rays worked on at once, and their nearest hits so far.

    Attributes
    ----------
    origins : (3, 1) or (3, N) float64
        One origin for all, or one a ray.
    directions : (3, N) float64
        Any length; `t` counts in units of it.
    pixels, samples : (N,) int64
        Number of the pixel (row * width + column) and of the sample in it.
    screen : (4,) float64 or None
        Least and greatest place on the camera's screen, across and along; None for rays that do not
        come from the camera.
    origin_surfaces : OriginSurfaces or None
        The surfaces that they leave; None for rays that begin in the open.
    t : (N,) float64
        Distance of the nearest hit, inf for none.
    shapes, primitives : (N,) int64
    coordinates : (3, N) float64
        Surface coordinates of the hit, two or three, as the shape defines them.
    """

    origins: Floats
    directions: Floats
    pixels: Integers
    samples: Integers
    screen: Floats | None = None
    origin_surfaces: OriginSurfaces | None = None
    t: Floats = field(init=False)
    shapes: Integers = field(init=False)
    primitives: Integers = field(init=False)
    coordinates: Floats = field(init=False)

    def __post_init__(self) -> None:
        """Begin with no hit."""
        count = self.directions.shape[1]
        self.t = np.full(count, np.inf)
        self.shapes = np.full(count, MISS, dtype=np.int64)
        self.primitives = np.zeros(count, dtype=np.int64)
        self.coordinates = np.zeros((3, count))

    def anew(self) -> "Rays":
        """The same rays, which have hit nothing yet."""
        return Rays(self.origins, self.directions, self.pixels, self.samples, None, self.origin_surfaces)

    def origins_at(self, index: Integers) -> Floats:
        """Origins of some rays, (3, 1) if all share one."""
        return self.origins if self.origins.shape[1] == 1 else taken(self.origins, index)

    def offer(
        self,
        candidates: Integers,
        t: Floats,
        coordinates: tuple[Floats, ...],
        shapes: Integers,
        primitives: Integers,
    ) -> None:
        """Take hits that are nearer than the ones known.

        Of equal ones the lowest shape number wins, and within a shape the lowest primitive.

        Parameters
        ----------
        candidates : (M,) int64
            Rays that hit something, each once.
        t : (M,) float64
        coordinates : two or three of (M,) float64
        shapes, primitives : (M,) or (1,) int64
            Numbers of what they hit.
        """
        shapes, primitives = (np.broadcast_to(numbers, t.shape) for numbers in (shapes, primitives))
        known, shape = self.t[candidates], self.shapes[candidates]
        first = (shapes < shape) | ((shapes == shape) & (primitives < self.primitives[candidates]))
        nearer = (t < known) | ((t == known) & first)
        rays = candidates[nearer]
        self.t[rays] = t[nearer]
        self.shapes[rays], self.primitives[rays] = shapes[nearer], primitives[nearer]
        for row, values in zip(self.coordinates, coordinates, strict=False):
            row[rays] = values[nearer]

    def offer_several(
        self,
        candidates: Integers,
        t: Floats,
        coordinates: tuple[Floats, Floats],
        items: Integers,
        numbers: tuple[Integers, Integers],
    ) -> None:
        """Take the nearest of a ray's hits, of equal ones the first item, as `offer` does.

        Parameters
        ----------
        candidates : (M,) int64
            Rays, each as often as it hits something.
        t : (M,) float64
        coordinates : two of (M,) float64
        items : (M,) int64
            Items of the family that they hit.
        numbers : two of (K,) int64
            Shape and primitive of each item.
        """
        best = first_of_each(candidates, np.lexsort((items, t, candidates)))
        shapes, primitives = (number[items[best]] for number in numbers)
        u, v = coordinates
        self.offer(candidates[best], t[best], (u[best], v[best]), shapes, primitives)


def first_of_each(owners: Integers, order: Integers) -> Integers:
    """The first place in `order` (M,) of each owner, by whom it is sorted."""
    return order[np.flatnonzero(np.diff(owners[order], prepend=-1))]


class RayStage(Protocol):
    """Works on a block of rays."""

    def run(self, rays: Rays) -> None:
        """Change the rays' hits."""
        ...


@dataclass(slots=True, eq=False)
class Points:
    """M hits of rays with shapes, with their attributes for shading.

    Attributes that not every scene needs exist only if a stage of the plan reads them; otherwise reading them
    raises AttributeError.

    Attributes
    ----------
    rays : (M,) int64
        Index of the ray in the block.
    pixels, samples : (M,) int64
        Those of the ray.
    paths : (M,) uint64
        Name of the bounces before; 0 where the camera sees the point.
    path_lengths : (M,) float64
        Length of the path before the ray, scene units; 0 where the camera sees the point.
    origins : (3, 1) or (3, M) float64
    previous_origins : (3, 1) or (3, M) float64
        The origins, but for rays of zero length (`OriginSurfaces.origins_before_hits`).
    directions : (3, M) float64
    t : (M,) float64
    hits : (3, M) float64
        Surface coordinates of the hit, two or three, as the shape defines them.
    shapes, primitives, materials : (M,) int64
    positions : (3, M) float64
        On the surface, rebuilt from its coordinates; error at most `numerics.PLANE_ERROR` times `sizes`.
    normals : (3, M) float64
        Geometric unit normals on the side the ray came from.
    shading_normals : (3, M) float64
        Unit; the same array as `normals` unless `bent`.
    flipped : (M,) bool
        Whether the ray came from behind, so that the outward normal was turned.
    sizes : (M,) float64
        Sum of the magnitudes that formed the position, scene units.
    colors : (3, M) float64
        Of the surface, linear.
    radiance : (3, M) float64
        Towards the viewer, gathered by the stages.
    shading_error : (M,) float64
        Expected squared error of the radiance, since variation within the pixel has few samples.
    bent : bool
        Whether shading normals may differ from geometric ones.
    lookups : int
        Texture look-ups made for the points so far.
    viewers : (3, M) float64
        Unit vectors back along the rays; where a stage asked for them, as all that follows.
    coordinates : (2, M) float64
        Texture coordinates (u, v).
    frames : (4, M) float64
        Unit tangents, in which u grows; in the last row 1 where v grows along outward normal x tangent, -1
        where it grows against it: mirrored coordinates.
    tangents : (6, M) float64
        Tangents and cotangents of normal maps, on the side that the ray came from.
    derivatives : (6, M) float64
        Of the position by u and by v, on the outward side, scene units.
    footprints : (2, 2, M) float64
        Changes of (u, v) for two offsets by a sample's share of the pixel: coordinate, offset, point.
    """

    rays: Integers
    pixels: Integers
    samples: Integers
    paths: Keys
    path_lengths: Floats
    origins: Floats
    previous_origins: Floats
    directions: Floats
    t: Floats
    hits: Floats
    shapes: Integers
    primitives: Integers
    materials: Integers
    positions: Floats
    normals: Floats
    shading_normals: Floats
    flipped: Masks
    sizes: Floats
    colors: Floats
    radiance: Floats
    shading_error: Floats
    bent: bool
    lookups: int = 0
    viewers: Floats = field(init=False)
    coordinates: Floats = field(init=False)
    frames: Floats = field(init=False)
    tangents: Floats = field(init=False)
    derivatives: Floats = field(init=False)
    footprints: Floats = field(init=False)

    @property
    def count(self) -> int:
        """Number of points M."""
        return self.rays.shape[0]

    def face_rays(self, chosen: Integers, normals: Floats, flipped: Masks) -> Floats:
        """Set the normals of some points, (3, M), outward ones turned where rays came from behind."""
        facing = normals * np.where(flipped, -1.0, 1.0)
        self.flipped[chosen] = flipped
        put(self.normals, chosen, facing)
        put(self.shading_normals, chosen, facing)
        return facing

    def previous_origins_at(self, index: Integers) -> Floats:
        """Previous origins of some points, (3, 1) if all share one."""
        every = self.previous_origins
        return every if every.shape[1] == 1 else taken(every, index)

    def origin_surfaces(self, index: Integers) -> OriginSurfaces:
        """The surfaces that rays leave which begin at some points, on the side that is seen."""
        return OriginSurfaces(
            shapes=self.shapes[index],
            primitives=self.primitives[index],
            outside=~self.flipped[index],
            sizes=self.sizes[index],
            previous_origins=self.previous_origins_at(index),
            paths=self.paths[index],
            path_lengths=self.path_lengths[index],
        )

    def went_nowhere(self, index: Integers) -> Masks:
        """Whether the rays to some points that left surfaces ended where they began, (m,)."""
        return (self.previous_origins[:, index] != self.origins[:, index]).any(axis=0)

    def footprints_at(self, index: Integers) -> Floats | None:
        """Footprints of some points, if any stage asked for them."""
        return taken(self.footprints, index) if hasattr(self, "footprints") else None

    def between(self, start: int, stop: int) -> "Points":
        """The points start..stop as views, whose radiance is that of these points."""
        return self._cut(lambda values: values[..., start:stop])

    def part(self, index: Integers) -> "Points":
        """Copies of some points (m,)."""
        return self._cut(lambda values: np.take(values, index, axis=-1))

    def _cut(self, cut: Callable[[NDArray[Any]], NDArray[Any]]) -> "Points":
        """All arrays sliced alike, except origins that all points share."""
        part = copy(self)
        for item in fields(self):
            value = getattr(self, item.name, None)
            if isinstance(value, np.ndarray) and value.shape[-1] == self.count:
                setattr(part, item.name, cut(value))
        return part


def points_of(rays: Rays, materials: Integers, *, bent: bool) -> Points:
    """The points where rays hit shapes, with uninitialised attributes for the stages.

    Parameters
    ----------
    rays : Rays
    materials : (shapes of the scene,) int64
        Number of each shape's material.
    bent : bool
        Whether some stage bends shading normals.
    """
    hit = np.flatnonzero((rays.shapes >= 0) & (rays.shapes < EMITTER))
    count = hit.size
    shapes = rays.shapes[hit]
    normals = np.zeros((3, count))
    origins, start = rays.origins_at(hit), rays.origin_surfaces
    return Points(
        rays=hit,
        pixels=rays.pixels[hit],
        samples=rays.samples[hit],
        paths=np.zeros(count, dtype=np.uint64) if start is None else start.paths[hit],
        path_lengths=np.zeros(count) if start is None else start.path_lengths[hit],
        origins=origins,
        previous_origins=_previous_origins(rays, hit, origins),
        directions=taken(rays.directions, hit),
        t=rays.t[hit],
        hits=taken(rays.coordinates, hit),
        shapes=shapes,
        primitives=rays.primitives[hit],
        materials=materials[shapes],
        positions=np.zeros((3, count)),
        normals=normals,
        shading_normals=np.zeros((3, count)) if bent else normals,
        flipped=np.zeros(count, dtype=bool),
        sizes=np.zeros(count),
        colors=np.zeros((3, count)),
        radiance=np.zeros((3, count)),
        shading_error=np.zeros(count),
        bent=bent,
    )


@dataclass(frozen=True, slots=True)
class Viewers:
    """Stage: unit vectors back along the rays."""

    def run(self, points: Points) -> None:
        """Give the points their viewers."""
        points.viewers = -unit(points.directions)


def _previous_origins(rays: Rays, hit: Integers, origins: Floats) -> Floats:
    if rays.origin_surfaces is None:
        return origins
    ways = rays.t[hit] * taken(rays.directions, hit)
    return rays.origin_surfaces.origins_before_hits(hit, origins, ways)
