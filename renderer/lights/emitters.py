"""Emitters: a common representation of rectangle, point and directional lights.

The light points are q = centre + u first + v second with weight w. A rectangle has w = 1; a point light
has edges of length 0; a directional light is a point at infinity, w = 0, whose centre is the unit vector
towards it. A function affine in space, f(x) = m . (x - x0), is m . (q - w x0) on all of them.
"""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

import schemas.lights as language
from renderer.lights.samples import Grid, LightPoints, Scatter
from renderer.math.arrays import Floats, Integers, column, cross, dot, lengths, magnitude, unit
from renderer.math.numerics import PLANE_ERROR
from renderer.math.streams import Keys, keys
from renderer.samplers import FIXED, PATTERNS, strata
from renderer.shapes.frames import frame_of_normals
from renderer.shapes.rectangles import edges_of
from schemas.quality import LightSampling

PIXEL_DIMENSIONS = 0
"""Stream of the places in a pixel; light number i has stream 1 + i."""


@dataclass(frozen=True, slots=True, eq=False)
class Emitter:
    """A light and its sampling.

    Attributes
    ----------
    number : int
        Place in the scene's list of lights.
    centre, first, second : (3, 1) float64
    weight : float
        1, or 0 for a light at infinity.
    across, along, normal : (3, 1) float64
        Orthonormal axes; `normal` is the front of a rectangle, and the way a spot light shines.
    color : (3, 1) float64
        Linear.
    orthogonal : bool
        Whether the edges are perpendicular.
    least_cosine : float or None
        Of the angle at the light between `normal` and what it lights; None if it lights all around.
    count : int
        Light points L a shading point.
    pattern : str
    seed : int
    size : float
        Sum of the magnitudes that form a light point, scene units.
    """

    number: int
    centre: Floats
    first: Floats
    second: Floats
    weight: float
    across: Floats
    along: Floats
    normal: Floats
    color: Floats
    orthogonal: bool
    least_cosine: float | None
    count: int
    pattern: str
    seed: int
    size: float

    @classmethod
    def of(cls, light: "Emitter", **changes: Any) -> Self:
        """An emitter of this class from another one, with changes."""
        return cls(**{item.name: getattr(light, item.name) for item in fields(Emitter)} | changes)

    @property
    def shared(self) -> bool:
        """Whether all points of the scene see the same light points."""
        return self.pattern in FIXED

    @property
    def scale(self) -> float:
        """Sum of the magnitudes that form a light point: its size, or 1 for a direction."""
        return self.size if self.weight else 1.0

    @property
    def extent(self) -> float:
        """Sum of the magnitudes of the edges."""
        return float((magnitude(self.first) + magnitude(self.second)).item())

    def grid(self) -> tuple[Floats, Floats]:
        """U of the columns and v of the rows of the shared grid, in (-1/2, 1/2)."""
        columns, rows = strata(self.count)
        return (np.arange(columns) + 0.5) / columns - 0.5, (np.arange(rows) + 0.5) / rows - 0.5

    def shared_points(self) -> Floats:
        """The light points that all share, (3, L), in the order of `points`."""
        u, v = self.grid()
        return self.centre + self.first * u.repeat(v.size) + self.second * np.tile(v, u.size)

    def points(
        self, pixels: Integers, samples: Integers, paths: Keys, dtype: np.dtype[np.floating]
    ) -> LightPoints:
        """Light points for each bounce of each camera sample, (n,) pixel, sample and path numbers."""
        if self.shared:
            u, v = self.grid()
            if self.orthogonal:
                return Grid(u, v)
            return Scatter(u.repeat(v.size)[:, None].astype(dtype), np.tile(v, u.size)[:, None].astype(dtype))
        key = keys(self.seed, paths + np.uint64(1 + self.number), pixels, samples)
        index = np.arange(self.count, dtype=np.int64)[:, None]
        a, b = PATTERNS[self.pattern](key[None, :], index, self.count)
        return Scatter((a - 0.5).astype(dtype), (b - 0.5).astype(dtype))

    def towards(self, points: Floats) -> Floats:
        """Light centre minus points, (3, n); for a light at infinity the unit vector towards it."""
        if self.weight == 0:
            return np.broadcast_to(self.centre, points.shape)
        return self.centre - points

    def ends(self) -> Floats:
        """Corners of the light, (3, 4)."""
        u, v = np.array([-0.5, 0.5, -0.5, 0.5]), np.array([-0.5, -0.5, 0.5, 0.5])
        return self.centre + self.first * u + self.second * v


_NOTHING = np.zeros((3, 1))


def build_rectangle(
    number: int,
    light: language.RectangleLight | language.ParallelogramLight,
    sampling: LightSampling,
    seed: int,
) -> Emitter:
    """A rectangle light."""
    if isinstance(light, language.ParallelogramLight):
        corner, first, second = column(light.corner), column(light.edges[0]), column(light.edges[1])
        centre = corner + first / 2 + second / 2
    else:
        centre = column(light.center)
        _, first, second = edges_of(centre, column(light.normal), column(light.tangent), light.size)
    axes = unit(first), unit(cross(unit(first), unit(second)))
    return _emitter(number, light, sampling, seed, centre, axes, edges=(first, second))


def build_point(
    number: int, light: language.PointLight | language.SpotLight, sampling: LightSampling, seed: int
) -> Emitter:
    """A point light."""
    del sampling
    normal = column((0.0, 0.0, 1.0))
    axes = frame_of_normals(normal), normal
    return _emitter(number, light, _ONE_POINT, seed, column(light.position), axes)


def build_directional(
    number: int, light: language.DirectionalLight, sampling: LightSampling, seed: int
) -> Emitter:
    """A light at infinity."""
    del sampling
    centre = -unit(column(light.direction))
    normal = unit(centre)
    axes = frame_of_normals(normal), normal
    return _emitter(number, light, _ONE_POINT, seed, centre, axes, weight=0.0)


_ONE_POINT = LightSampling(pattern="uniform", samples=1)


def _emitter(
    number: int,
    light: language.Light,
    sampling: LightSampling,
    seed: int,
    centre: Floats,
    axes: tuple[Floats, Floats],
    *,
    edges: tuple[Floats, Floats] = (_NOTHING, _NOTHING),
    weight: float = 1.0,
) -> Emitter:
    """A light with given axes, across and normal."""
    (first, second), (across, normal) = edges, axes
    return Emitter(
        number=number,
        centre=centre,
        first=first,
        second=second,
        weight=weight,
        across=across,
        along=cross(normal, across),
        normal=normal,
        color=column(light.color),
        # Edges that are perpendicular up to rounding may use the shorter formulas of a grid.
        orthogonal=abs(dot(second, across).item()) <= PLANE_ERROR * lengths(second).item(),
        least_cosine=None if getattr(light, "two_sided", True) else 0.0,
        count=sampling.samples,
        pattern=sampling.pattern,
        seed=seed,
        size=weight * float((magnitude(centre) + magnitude(first) + magnitude(second)).item()),
    )
