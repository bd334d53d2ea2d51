"""Lighting of pilot samples by area lights: shadow rays classify points as lit, in penumbra or in umbra.

Where the whole light is visible, its radiance is a smooth function of the position on a rectangle, and the
midpoint rule on a small grid integrates it without noise. Only penumbrae need many light points.
"""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, lengths
from renderer.plan.stages import Lighting
from renderer.workspace import FEWEST_POINTS, PAIRS_AT_ONCE, Workspace

SIDES = (2, 4, 8, 16)
"""Cells along each side of the grids on a fully visible light."""

MIN_DISTANCE_RATIO = 4
"""Least distance that grids are made for, as a fraction of the light's size: its reciprocal."""

PROBE_SIDE, MAX_PROBE_SIDE = 4, 10
"""Points along each side of a light that classify visibility, at a target error of 1/255, and at most. The
outermost lie on its edges, so that behind convex occluders larger than the gaps between them no penumbra is
taken for umbra."""


def probe_side(error: float) -> int:
    """Points along a side of the classifying grid for a target error.

    A round occluder that reaches in between two of them hides a part of the light proportional to the cube of
    the gap. With 4 at 0.1/255, a ball's shadow on a bump-mapped wall was 0.4/255 too bright in the
    mean, with 8 0.09/255, and the picture took a fifth of the samples.
    """
    return int(np.clip(round(PROBE_SIDE * (1 / 255 / error) ** (1 / 3)), PROBE_SIDE, MAX_PROBE_SIDE))


@dataclass(frozen=True, slots=True, eq=False)
class ProbingEmitter(Emitter):
    """An area light with points on a grid that includes its edges."""

    def grid(self) -> tuple[Floats, Floats]:
        """U of the columns and v of the rows, from -1/2 to 1/2."""
        along = np.linspace(-0.5, 0.5, round(self.count**0.5))
        return along, along


@dataclass(frozen=True, slots=True, eq=False)
class PilotLighting:
    """Direct lighting of pilot samples from one area light.

    Attributes
    ----------
    probe : Lighting
        Points including the edges, with shadows and without terms.
    whole : tuple of Lighting
        A grid of each of `SIDES`, with terms and without shadows.
    partial : Lighting
        Many points, with shadows and terms.
    grid_sides : (materials,) float64
        Cells along a side that a material needs at a distance equal to the light's size.
    """

    probe: Lighting
    whole: tuple[Lighting, ...]
    partial: Lighting
    grid_sides: Floats

    @property
    def emitter(self) -> Emitter:
        """The light, with the points of the classifying grid."""
        return self.probe.emitter

    @property
    def casts(self) -> bool:
        """Whether anything may occlude it."""
        return self.partial.casts

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the light to the points' radiance; return the number of shadow rays."""
        view = self.probe.view(points, workspace)
        rays = view.count * view.light_points.count if self.probe.shadows else 0
        lit, penumbra = partition_of(view)
        sides = self.sides(view, lit)
        for number, lighting in enumerate(self.whole):
            lighting.run(points, workspace, view.chosen[lit[sides == number]])
        step = max(FEWEST_POINTS, PAIRS_AT_ONCE // self.partial.emitter.count)
        for start in range(0, penumbra.size, step):
            rays += self.partial.run(points, workspace, view.chosen[penumbra[start : start + step]])
        return rays

    def sides(self, view: LightView, index: Integers) -> Integers:
        """Grid numbers for some points (m,) of a view.

        The midpoint rule errs by the second derivative over 24 n n; that of the cosine at a point is
        proportional to the square of the light's size over its distance, and that of a highlight to the
        exponent as well.
        """
        emitter = self.emitter
        size = max(lengths(emitter.first).item(), lengths(emitter.second).item())
        nearness = size / np.maximum(lengths(view.towards[:, index]), size / MIN_DISTANCE_RATIO)
        needed = nearness * self.grid_sides[view.of_points(view.points.materials)[index]]
        return np.minimum(np.searchsorted(SIDES, needed), len(SIDES) - 1)


def partition_of(view: LightView) -> tuple[Integers, Integers]:
    """Points of a view that see all of the light, and points in its penumbra."""
    if view.blocked is None:
        return np.arange(view.count), np.arange(0)
    occluded = np.logical_or.reduce(view.blocked, axis=0)
    dark = np.logical_and.reduce(view.blocked, axis=0)
    return np.flatnonzero(~occluded), np.flatnonzero(occluded & ~dark)


def grid_sides(error: float, brightest: float, curvatures: Floats) -> Floats:
    """`PilotLighting.grid_sides` of materials (K,), for grid errors of a quarter of the target error."""
    return np.sqrt(brightest * curvatures / (24 * error / 4))
