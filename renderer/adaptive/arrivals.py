"""What light reaches the centres of pixels whose texture is shaded at many places: nodes with weights.

Light varies slowly where texels do not. The directions lie on a Gauss-Legendre grid on the light; where it is
partially occluded, each stands for the visible share of its cell.
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from renderer.adaptive.lighting import NEAREST, partition_of
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView, Weights
from renderer.materials.reflection import LightTerm
from renderer.math.arrays import Floats, Integers, lengths, put, taken
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
"""Places along a side of a light from -1/2 to 1/2, and their shares of it: Gauss and Legendre's."""

NODE_ERRORS = 0.0045, 0.0018
"""RMS errors of cosines with 2 and 3 places along a side of a light that is as large as its distance, normals
and mirrored directions being random; they fall with the distance to the power 1.5. With 4, 0.0009."""

ALLOWED = 1 / 4
"""Share of the target error that they may have."""


def sides_for(emitters: Iterable[Emitter], positions: Floats, error: float) -> Integers:
    """Places along a side of a light that points (3, n) need for a target error, by the nearest light."""
    needed = np.full(positions.shape[1], min(NODES))
    for emitter in emitters:
        size = max(lengths(emitter.first).item(), lengths(emitter.second).item())
        if size:
            nearness = size / np.maximum(lengths(emitter.towards(positions)), size / NEAREST)
            above = [each * nearness**1.5 > ALLOWED * error for each in NODE_ERRORS]
            np.maximum(needed, min(NODES) + np.sum(above, axis=0), out=needed)
    return needed


class Arrival(Protocol):
    """One light at pixels whose fine texture shares the light of their centres."""

    @property
    def emitter(self) -> Emitter:
        """The light."""
        ...

    @property
    def terms(self) -> tuple[LightTerm, ...]:
        """The terms of materials for it."""
        ...

    def view(self, points: Points) -> tuple[LightView, int]:
        """The light with what arrives of it at points as its weights, and the number of shadow rays."""
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
        """Weight of each node in the mean over all, (J, 1)."""
        _, shares = NODES[self.side]
        return self.count * np.outer(shares, shares).reshape(-1, 1)


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
    nodes : Lighting
        From a `NodeEmitter`, without shadows.
    """

    probe: Lighting
    partial: Lighting
    nodes: Lighting

    @property
    def emitter(self) -> Emitter:
        """The light, with as many points as every point that faces it is probed with."""
        return self.probe.emitter

    @property
    def terms(self) -> tuple[LightTerm, ...]:
        """The terms of materials for it."""
        return self.nodes.terms

    def view(self, points: Points) -> tuple[LightView, int]:
        """The nodes, each with the share of its cell that is seen."""
        nodes, workspace = self.nodes.emitter, Workspace()
        assert isinstance(nodes, NodeEmitter)
        view = self.probe.view(points, workspace)
        rays = view.count * view.light_points.count if self.probe.shadows else 0
        lit, part = (view.chosen[index] for index in partition_of(view))
        shares = np.zeros((nodes.count, points.count))
        shares[:, lit] = nodes.shares()
        step = max(FEWEST_POINTS, PAIRS // self.partial.emitter.count)
        for start in range(0, part.size, step):
            some = part[start : start + step]
            view = self.partial.view(points, workspace, some)
            rays += view.count * view.light_points.count
            put(shares, some, nodes.shares() * cell_shares(view, nodes.side))
        chosen = np.sort(np.concatenate((lit, part)))
        view = self.nodes.view(points, workspace, chosen)
        return _weighted(view, self.nodes, taken(shares, chosen)), rays


@dataclass(frozen=True, slots=True)
class PointArrival:
    """A light without an area."""

    lighting: Lighting

    @property
    def emitter(self) -> Emitter:
        """The light."""
        return self.lighting.emitter

    @property
    def terms(self) -> tuple[LightTerm, ...]:
        """The terms of materials for it."""
        return self.lighting.terms

    def view(self, points: Points) -> tuple[LightView, int]:
        """Its one direction, where it is seen."""
        view = self.lighting.view(points, Workspace())
        rays = view.count if self.lighting.shadows else 0
        view.drop_dark()
        return _weighted(view, self.lighting, np.ones((1, view.count))), rays


def _weighted(view: LightView, lighting: Lighting, shares: Floats) -> LightView:
    """A view with `shares` (L, n), its own weights and what is blocked as weights alone."""
    if view.count:
        for weight in lighting.weights:
            weight.run(view)
    if view.blocked is not None:
        shares = shares * ~view.blocked
        view.blocked = None
    view.weigh(Weights(shares.astype(view.dtype), np.ones(view.count)))
    return view


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
