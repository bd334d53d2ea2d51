"""Lights that shine on the wrong side of surfaces, or subtract where they should add nothing."""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.plan.stages import Lighting
from renderer.workspace import Workspace


@dataclass(frozen=True, slots=True)
class AlteredLight(ABC):
    """A light that does something else than it should.

    Attributes
    ----------
    right : Lighting
        The light as it should be, with all its shadows.
    """

    right: Lighting

    @property
    def emitter(self) -> Emitter:
        """The light."""
        return self.right.emitter

    @property
    def casts(self) -> bool:
        """Whether anything can stand in its way."""
        return self.right.casts

    @abstractmethod
    def run(self, points: Points, workspace: Workspace) -> int:
        """Change the points' radiance; gives the number of shadow rays."""


@dataclass(frozen=True, slots=True)
class FromBehind(AlteredLight):
    """A light that reaches the side of surfaces that the viewer does not see."""

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add what reaches the other side."""
        return self.right.run(turned(points), workspace)


@dataclass(frozen=True, slots=True)
class Subtracted(AlteredLight):
    """A light for which n . l counts where it is below 0.

    Attributes
    ----------
    shadowed : bool
        Whether shadow rays end the loss as well: a round shape then shadows its own dark side.
    """

    shadowed: bool

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the light, and subtract the diffuse term of the other side."""
        matt = tuple(term for term in self.right.terms if term.adds == "diffuse")
        shadows = self.right.shadows if self.shadowed else ()
        behind = turned(points)
        behind.radiance = np.zeros_like(points.radiance)
        rays = self.right.run(points, workspace)
        rays += replace(self.right, terms=matt, shadows=shadows).run(behind, workspace)
        points.radiance -= behind.radiance
        return rays


def turned(points: Points) -> Points:
    """The same points as if their rays had come from the other side; the radiance is shared."""
    behind = copy(points)
    behind.normals, behind.flipped = -points.normals, ~points.flipped
    behind.shading_normals = -points.shading_normals
    return behind
