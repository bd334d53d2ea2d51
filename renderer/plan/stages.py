"""Stages of a plan, each with the parts of the scene that requested it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView, facing
from renderer.materials.reflection import LightTerm
from renderer.math.arrays import Integers, taken
from renderer.waves import Wave
from renderer.workspace import Workspace


class PointStage(Protocol):
    """Works on the points of a block."""

    def run(self, points: Points) -> None:
        """Change the points."""
        ...


class LightStage(Protocol):
    """Works on the pairs of points and light points."""

    def run(self, view: LightView) -> None:
        """Mark pairs as blocked, or weigh them."""
        ...


class ScatteringStage(Protocol):
    """Sends new rays from points."""

    def run(self, points: Points, wave: Wave) -> Sequence[Wave]:
        """Rays that leave the points that a wave has hit."""
        ...


class Illumination(Protocol):
    """Direct lighting of points from one light, or from several."""

    @property
    def emitter(self) -> Emitter:
        """The light."""
        ...

    @property
    def casts(self) -> bool:
        """Whether anything can stand in its way."""
        ...

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the light to the points' radiance; gives the number of shadow rays."""
        ...


@dataclass(frozen=True, slots=True)
class Lighting:
    """Direct lighting from one light: facing, shadow, weight and material stages.

    Attributes
    ----------
    emitter : Emitter
    shadows, weights, terms : tuples of stages
        In the order in which they run.
    dtype : float32 or float64
        Of pair work.
    """

    emitter: Emitter
    shadows: tuple[LightStage, ...]
    weights: tuple[LightStage, ...]
    terms: tuple[LightTerm, ...]
    dtype: np.dtype[np.floating]

    @property
    def casts(self) -> bool:
        """Whether anything can stand in its way."""
        return bool(self.shadows)

    def view(self, points: Points, workspace: Workspace, among: Integers | None = None) -> LightView:
        """The light as seen by those of the points that face it, with blocked pairs marked.

        Points `among` (m,) are known to face it; without them, it is found out for all.
        """
        towards = self.emitter.towards(points.positions)
        chosen = np.flatnonzero(facing(self.emitter, points, towards)) if among is None else among
        view = LightView(
            emitter=self.emitter,
            points=points,
            chosen=chosen,
            light_points=self.emitter.points(
                points.pixels[chosen], points.samples[chosen], points.paths[chosen], self.dtype
            ),
            towards=taken(towards, chosen),
            origins=points.previous_origins_at(chosen),
            dtype=self.dtype,
            workspace=workspace,
        )
        if view.count:
            for shadow in self.shadows:
                shadow.run(view)
            if points.bent:
                view.block_below_horizon()
        return view

    def run(self, points: Points, workspace: Workspace, among: Integers | None = None) -> int:
        """Add the light to the points' radiance, as `view` sees it; gives the number of shadow rays."""
        view = self.view(points, workspace, among)
        rays = view.count * view.light_points.count if self.shadows else 0
        view.drop_dark()
        if view.count:
            for stage in (*self.weights, *self.terms):
                stage.run(view)
        return rays


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the plan.

    Attributes
    ----------
    name, effect, detail : str
    pointers : tuple of str
    seconds : float
        Predicted CPU seconds.
    """

    name: str
    effect: str
    detail: str
    pointers: tuple[str, ...]
    seconds: float = 0.0
