"""Gauss-Legendre quadrature of area lights for decoupled shading: incident light as weighted directions.

Incident light varies slowly over a pixel, texels do not. In penumbrae each node is weighted by the visible
share of its cell.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from renderer.adaptive.lighting import MIN_DISTANCE_RATIO, partition_of
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView, Weights
from renderer.math.arrays import Floats, Integers, lengths, put, taken
from renderer.plan.stages import Lighting
from renderer.workspace import FEWEST_POINTS, PAIRS_AT_ONCE, Workspace

GAUSS_LEGENDRE = {
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
"""Nodes along a side of a light, from -1/2 to 1/2, and their weights."""

QUADRATURE_ERRORS = 0.0045, 0.0018
"""RMS errors of cosines with 2 and 3 nodes along a side of a light as large as its distance, over random
normals and mirrored directions; they fall with the distance to the power 1.5. With 4 nodes, 0.0009."""

ERROR_SHARE = 1 / 4
"""Share of the target error for the quadrature."""


def sides_for(emitters: Iterable[Emitter], positions: Floats, error: float) -> Integers:
    """Nodes along a side of the lights that points (3, n) need for a target error, by the nearest light."""
    needed = np.full(positions.shape[1], min(GAUSS_LEGENDRE))
    for emitter in emitters:
        size = max(lengths(emitter.first).item(), lengths(emitter.second).item())
        if size:
            nearness = size / np.maximum(lengths(emitter.towards(positions)), size / MIN_DISTANCE_RATIO)
            above = [each * nearness**1.5 > ERROR_SHARE * error for each in QUADRATURE_ERRORS]
            np.maximum(needed, min(GAUSS_LEGENDRE) + np.sum(above, axis=0), out=needed)
    return needed


@dataclass(frozen=True, slots=True, eq=False)
class NodeEmitter(Emitter):
    """An area light with points at the nodes of a Gauss-Legendre grid."""

    @property
    def side(self) -> int:
        """Nodes along a side."""
        return round(self.count**0.5)

    def grid(self) -> tuple[Floats, Floats]:
        """U of the columns and v of the rows, from -1/2 to 1/2."""
        places, _ = GAUSS_LEGENDRE[self.side]
        return places, places

    def shares(self) -> Floats:
        """Weight of each node relative to the mean weight, (J, 1)."""
        _, shares = GAUSS_LEGENDRE[self.side]
        return self.count * np.outer(shares, shares).reshape(-1, 1)


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Incident light from one light at the centres of pixels.

    Attributes
    ----------
    probe, partial : Lighting
        As in `lighting.PilotLighting`; both the light itself if it has no area.
    nodes : Lighting
        From a `NodeEmitter`, without shadows; the light itself if it has no area.
    """

    probe: Lighting
    partial: Lighting
    nodes: Lighting

    def view(self, points: Points) -> tuple[LightView, int]:
        """View of the nodes, weighted by the visible shares of their cells, and the number of shadow rays."""
        nodes, workspace = self.nodes.emitter, Workspace()
        view = self.probe.view(points, workspace)
        rays = view.count * view.light_points.count if self.probe.shadows else 0
        if not isinstance(nodes, NodeEmitter):
            view.drop_dark()
            return _weighted(view, self.nodes, np.ones((1, view.count))), rays
        lit, part = (view.chosen[index] for index in partition_of(view))
        shares = np.zeros((nodes.count, points.count))
        shares[:, lit] = nodes.shares()
        step = max(FEWEST_POINTS, PAIRS_AT_ONCE // self.partial.emitter.count)
        for start in range(0, part.size, step):
            some = part[start : start + step]
            view = self.partial.view(points, workspace, some)
            rays += view.count * view.light_points.count
            put(shares, some, nodes.shares() * cell_shares(view, nodes.side))
        chosen = np.sort(np.concatenate((lit, part)))
        view = self.nodes.view(points, workspace, chosen)
        return _weighted(view, self.nodes, taken(shares, chosen)), rays


def _weighted(view: LightView, lighting: Lighting, shares: Floats) -> LightView:
    """Combine `shares` (L, n), a view's own weights and its visibility into weights."""
    if view.count:
        for weight in lighting.weights:
            weight.run(view)
    if view.blocked is not None:
        shares = shares * ~view.blocked
        view.blocked = None
    view.weigh(Weights(shares.astype(view.dtype), np.ones(view.count)))
    return view


def cell_shares(view: LightView, side: int) -> Floats:
    """Visible share of each node's cell, (J, n); of the whole light where no point fell on a cell."""
    cells = side * side
    if view.blocked is None:
        return np.ones((cells, view.count))
    seen = ~view.blocked
    u, v = view.light_points.places(np.arange(view.count))
    borders = np.cumsum(GAUSS_LEGENDRE[side][1])[:-1] - 0.5
    numbers = np.searchsorted(borders, u) * side + np.searchsorted(borders, v)
    whole = seen.mean(axis=0)
    found = np.empty((cells, view.count))
    for number, share in enumerate(found):
        inside = np.broadcast_to(numbers == number, seen.shape)
        points = inside.sum(axis=0)
        share[...] = np.where(points > 0, (inside & seen).sum(axis=0) / np.maximum(points, 1), whole)
    return found
