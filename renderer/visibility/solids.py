"""Shadows of the insides of closed meshes: pairs whose segment passes a box there are blocked.

The surface is between the box and the light point, wherever the shaded point is: light and mesh lie apart.
Every comparison leaves room for its rounding on the side of 'not blocked', and what is left goes through the
tree. So no pixel depends on the boxes.
"""

from dataclasses import dataclass

import numpy as np

from renderer.accelerators.boxes import Boxes
from renderer.accelerators.bvh import Level, from_root
from renderer.accelerators.shafts import visits_of_shafts
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.math.arrays import Floats, Integers, Masks
from renderer.visibility.shafts import shafts_of


@dataclass(frozen=True, slots=True)
class SolidShadows:
    """Shadow stage: boxes inside closed meshes between points and one light.

    Attributes
    ----------
    boxes : Boxes
    emitter : Emitter
    dtype : float32 or float64
        Of the work for each light point.
    """

    boxes: Boxes
    emitter: Emitter
    dtype: np.dtype[np.floating]

    def run(self, view: LightView) -> None:
        """Mark pairs that pass a box."""
        shafts = shafts_of(view, 0.0)
        level = Level.of(self.boxes.low[:, :, None], self.boxes.high[:, :, None])
        visits = visits_of_shafts((level,), shafts, from_root(np.arange(view.count)))
        for box in range(self.boxes.count):
            index = visits.rays[visits.nodes == box]
            if index.size:
                hidden = self._passing(view, shafts.points[:, index], index, box)
                if hidden.any():
                    view.block(hidden, index)

    def _passing(self, view: LightView, positions: Floats, index: Integers, box: int) -> Masks:
        """Pairs (L, m) of the points at `positions` (3, m) that pass a box."""
        u, v = view.light_points.places(index)
        towards = self.emitter.towards(positions)
        room = 1 + 32 * float(np.finfo(self.dtype).eps)
        first, last = (
            np.zeros((), dtype=self.dtype),
            np.full((), 1.0 if self.emitter.weight else np.inf, dtype=self.dtype),
        )
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for axis in range(3):
                along = towards[axis] + u * self.emitter.first[axis] + v * self.emitter.second[axis]
                inverse = np.reciprocal(along.astype(self.dtype))
                low = (self.boxes.low[axis, box] - positions[axis]).astype(self.dtype) * inverse
                high = (self.boxes.high[axis, box] - positions[axis]).astype(self.dtype) * inverse
                first = np.maximum(first, np.minimum(low, high))
                last = np.minimum(last, np.maximum(low, high, out=high))
            return np.asarray(first * room < last)
