"""What light reaches points whose fine detail is shaded apart from it: a few directions with their weights.

Light varies slowly where texels do not. The directions lie on a Gauss-Legendre grid on the light; where it is
partially occluded, each stands for the visible share of its cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from renderer.adaptive.lighting import partition_of
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, put, unit
from renderer.plan.stages import Lighting
from renderer.workspace import FEWEST_POINTS, PAIRS, Workspace

NODES = {
    side: (np.array(places) / 2, np.array(shares) / 2)
    for side, (places, shares) in {
        2: ((-0.5773502691896257, 0.5773502691896257), (1.0, 1.0)),
        3: ((-0.7745966692414834, 0.0, 0.7745966692414834), (5 / 9, 8 / 9, 5 / 9)),
        4: (
            (-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526),
            (0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538),
        ),
    }.items()
}
"""Places along a side of a light from -1/2 to 1/2, and their shares of it: Gauss and Legendre's. Cosines and
highlights of exponent 40 err by 2e-3, 5e-4 and 3e-4 with 2, 3 and 4 of them."""

COARSE, FINE = 1.5 / 255, 0.2 / 255
"""From the first error on 2 places are enough, from the second on 3."""

SHARP = 80.0
"""Highlights of larger exponents take one place more."""


def side_for(error: float, shininess: float) -> int:
    """Places along a side of a light for an error and the greatest exponent of a highlight."""
    return min(2 + (error < COARSE) + (error < FINE) + (shininess > SHARP), max(NODES))


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """Light from one direction at n points.

    Attributes
    ----------
    directions : (3, n) float64
        Unit, towards the light.
    weights : (n,) float64
        Share of the light that arrives: after its own weights, and shadows.
    color : (3, 1) float64
    """

    directions: Floats
    weights: Floats
    color: Floats


class Arrival(Protocol):
    """One light at points whose detail is shaded apart from it."""

    @property
    def emitter(self) -> Emitter:
        """The light."""
        ...

    def run(self, points: Points, workspace: Workspace) -> tuple[Sequence[Beam], int]:
        """Its beams at all points (n,), and the number of shadow rays."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class NodeEmitter(Emitter):
    """A light whose points are the nodes of the Gauss-Legendre grid."""

    @property
    def side(self) -> int:
        """Nodes along a side."""
        return round(self.count**0.5)

    def grid(self) -> tuple[Floats, Floats]:
        """U of the columns and v of the rows, from -1/2 to 1/2."""
        places, _ = NODES[self.side]
        return places, places

    def shares(self) -> Floats:
        """Share of the light that each node stands for, (J, 1)."""
        _, shares = NODES[self.side]
        return np.outer(shares, shares).reshape(-1, 1)


def with_nodes(emitter: Emitter, side: int) -> NodeEmitter:
    """The same light with points on a grid of so many nodes a side."""
    values = {item.name: getattr(emitter, item.name) for item in fields(Emitter)}
    return NodeEmitter(**values | {"count": side * side, "pattern": "uniform"})


@dataclass(frozen=True, slots=True)
class AreaArrival:
    """A light with an area.

    Attributes
    ----------
    probe, partial : Lighting
        As in `lighting.PilotLighting`.
    nodes : NodeEmitter
    weighing : Lighting
        Of the nodes, without shadows and terms.
    """

    probe: Lighting
    partial: Lighting
    nodes: NodeEmitter
    weighing: Lighting

    @property
    def emitter(self) -> Emitter:
        """The light, with as many points as every point that faces it is probed with."""
        return self.probe.emitter

    def run(self, points: Points, workspace: Workspace) -> tuple[Sequence[Beam], int]:
        """The beams from the grid's nodes."""
        view = self.probe.view(points, workspace)
        rays = view.count * view.light_points.count if self.probe.shadows else 0
        lit, part = (view.chosen[index] for index in partition_of(view))
        weights = np.zeros((self.nodes.count, points.count))
        if lit.size:
            put(weights, lit, self._weights(points, lit, workspace))
        step = max(FEWEST_POINTS, PAIRS // self.partial.emitter.count)
        for start in range(0, part.size, step):
            some = part[start : start + step]
            seen = self.partial.view(points, workspace, some)
            rays += seen.count * seen.light_points.count
            # The next view takes the same buffers.
            shares = cell_shares(seen, self.nodes.side)
            put(weights, some, shares * self._weights(points, some, workspace))
        return self._beams(points, weights), rays

    def _weights(self, points: Points, chosen: Integers, workspace: Workspace) -> Floats:
        """What arrives from each node at some points (m,) if nothing stands between, (J, m)."""
        view = self.weighing.view(points, workspace, chosen)
        for weight in self.weighing.weights:
            weight.run(view)
        share = self.nodes.shares() * np.ones(view.count)
        if view.weights is not None:
            share *= view.weights.pairs
            share *= view.weights.factors
        if view.blocked is not None:
            share *= ~view.blocked
        return share

    def _beams(self, points: Points, weights: Floats) -> list[Beam]:
        emitter = self.emitter
        towards = emitter.towards(points.positions)
        across, along = self.nodes.grid()
        u, v = across.repeat(along.size), np.tile(along, across.size)
        return [
            Beam(unit(towards + emitter.first * u[j] + emitter.second * v[j]), share, emitter.color)
            for j, share in enumerate(weights)
            if share.any()
        ]


@dataclass(frozen=True, slots=True)
class PointArrival:
    """A light without an area.

    Attributes
    ----------
    lighting : Lighting
        With shadows and weights, and without terms.
    """

    lighting: Lighting

    @property
    def emitter(self) -> Emitter:
        """The light."""
        return self.lighting.emitter

    def run(self, points: Points, workspace: Workspace) -> tuple[Sequence[Beam], int]:
        """Its one beam."""
        view = self.lighting.view(points, workspace)
        rays = view.count if self.lighting.shadows else 0
        view.drop_dark()
        weights = np.zeros(points.count)
        if view.count:
            for weight in self.lighting.weights:
                weight.run(view)
            weights[view.chosen] = view.mean(np.ones((1, view.count), dtype=view.dtype))
        return [Beam(unit(self.emitter.towards(points.positions)), weights, self.emitter.color)], rays


def cell_shares(view: LightView, side: int) -> Floats:
    """Share of each node's cell that is seen, (J, n); where no point fell on a cell, of all the light."""
    cells = side * side
    if view.blocked is None:
        return np.ones((cells, view.count))
    seen = ~view.blocked
    u, v = view.light_points.places(np.arange(view.count))
    borders = np.cumsum(NODES[side][1])[:-1] - 0.5
    numbers = np.searchsorted(borders, u) * side + np.searchsorted(borders, v)
    whole = seen.mean(axis=0)
    found = np.empty((cells, view.count))
    for number, share in enumerate(found):
        inside = np.broadcast_to(numbers == number, seen.shape)
        points = inside.sum(axis=0)
        share[...] = np.where(points > 0, (inside & seen).sum(axis=0) / np.maximum(points, 1), whole)
    return found
