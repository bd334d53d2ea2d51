"""What pilot samples do about a light with an area: find out which points see all of it, and which a part.

Where nothing stands between, the light is a smooth function on a rectangle: a grid of few cells gives its
mean without noise. Where all is blocked there is nothing to add. Only in between are many points spent.
"""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, lengths
from renderer.plan.stages import Lighting
from renderer.workspace import FEWEST_POINTS, PAIRS, Workspace

SIDES = (2, 4, 8, 16)
"""Cells along each side of the grids on a light that is seen whole."""

NEAREST = 4
"""A light nearer than its size over this needs no finer grid than one that is as far away as that."""

CORNERS, MOST_CORNERS = 4, 10
"""Light points along each side that show which points see all of a light, at a target error of 1/255, and at
most. The outermost lie on its edges, so that for convex occluders larger than the gaps between them no point
that sees a part of the light is taken to see none of it."""


def corners_for(error: float) -> int:
    """Light points along a side of the probing grid for a target error.

    A round occluder that reaches in between two of them hides a part of the light proportional to the third
    power of the gap. With 4 at 0.1/255, a ball's shadow on a bump-mapped wall was 0.4/255 too bright in the
    mean, with 8 0.09/255, and the picture took a fifth of the samples.
    """
    return int(np.clip(round(CORNERS * (1 / 255 / error) ** (1 / 3)), CORNERS, MOST_CORNERS))


@dataclass(frozen=True, slots=True, eq=False)
class ProbingEmitter(Emitter):
    """A light whose points lie on a grid that reaches up to its edges."""

    def grid(self) -> tuple[Floats, Floats]:
        """U of the columns and v of the rows, from -1/2 to 1/2."""
        along = np.linspace(-0.5, 0.5, round(self.count**0.5))
        return along, along


@dataclass(frozen=True, slots=True, eq=False)
class PilotLighting:
    """All that one light does at a pilot sample.

    Attributes
    ----------
    probe : Lighting
        Light points up to the edges, with shadows and without terms.
    whole : tuple of Lighting
        A grid of each of `SIDES`, with terms and without shadows.
    partial : Lighting
        Many points, with shadows and terms.
    finest : (materials,) float64
        Cells along a side that a material needs where the light is as far away as it is large.
    """

    probe: Lighting
    whole: tuple[Lighting, ...]
    partial: Lighting
    finest: Floats

    @property
    def emitter(self) -> Emitter:
        """The light, with as many points as every point that faces it is probed with."""
        return self.probe.emitter

    @property
    def casts(self) -> bool:
        """Whether anything can stand in its way."""
        return self.partial.casts

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the light to the points' radiance; gives the number of shadow rays."""
        view = self.probe.view(points, workspace)
        rays = view.count * view.light_points.count if self.probe.shadows else 0
        lit, penumbra = partition_of(view)
        sides = self.sides(view, lit)
        for number, lighting in enumerate(self.whole):
            lighting.run(points, workspace, view.chosen[lit[sides == number]])
        step = max(FEWEST_POINTS, PAIRS // self.partial.emitter.count)
        for start in range(0, penumbra.size, step):
            rays += self.partial.run(points, workspace, view.chosen[penumbra[start : start + step]])
        return rays

    def sides(self, view: LightView, index: Integers) -> Integers:
        """Which of the grids some of a view's points (m,) need.

        The midpoint rule errs by the second derivative over 24 n n; that of the cosine at a point is
        proportional to the square of the light's size over its distance, and that of a highlight to the
        exponent as well.
        """
        emitter = self.emitter
        size = max(lengths(emitter.first).item(), lengths(emitter.second).item())
        nearness = size / np.maximum(lengths(view.towards[:, index]), size / NEAREST)
        needed = nearness * self.finest[view.of_points(view.points.materials)[index]]
        return np.minimum(np.searchsorted(SIDES, needed), len(SIDES) - 1)


def partition_of(view: LightView) -> tuple[Integers, Integers]:
    """Which of a view's points see all of the light, and which a part."""
    if view.blocked is None:
        return np.arange(view.count), np.arange(0)
    occluded = np.logical_or.reduce(view.blocked, axis=0)
    dark = np.logical_and.reduce(view.blocked, axis=0)
    return np.flatnonzero(~occluded), np.flatnonzero(occluded & ~dark)


def finest(error: float, brightest: float, curvatures: Floats) -> Floats:
    """`PilotLighting.finest` of materials (K,) for a target error, a quarter of which the grid may have."""
    return np.sqrt(brightest * curvatures / (24 * error / 4))
