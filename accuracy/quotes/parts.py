"""Parts of a picture that stand for the whole of it: squares from all over, one below the other.

Target quality decides by what neighbours show and by sums over the picture, so that it needs a picture and
not single pixels; what it asks of such squares it asks of their like.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from accuracy.quotes import places
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.plan import RenderPlan

SIDE = 32
"""Side of the squares, pixels: a sixteenth of their pixels lie beside a square from elsewhere."""

FEWEST = 8
"""Squares of a part: fewer tell little of the others."""


@dataclass(frozen=True, eq=False)
class Squares:
    """A camera that sees squares of a picture, one below the other.

    Attributes
    ----------
    camera : Pinhole
        Of the whole picture.
    corners : (n, 2) int64
        Columns and rows of the upper left pixels of the squares.
    """

    camera: Pinhole
    corners: Integers

    @property
    def width(self) -> int:
        """Pixels."""
        return SIDE

    @property
    def height(self) -> int:
        """Pixels."""
        return SIDE * len(self.corners)

    @property
    def position(self) -> Floats:
        """That of the camera, (3, 1)."""
        return self.camera.position

    @cached_property
    def _numbers(self) -> Integers:
        """Number of the square of each square of the grid, -1 where it is not part of this."""
        found = np.full((-(-self.camera.height // SIDE), -(-self.camera.width // SIDE)), -1)
        found[self.corners[:, 1] // SIDE, self.corners[:, 0] // SIDE] = np.arange(len(self.corners))
        return found

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """As of the camera, at places (N,) and (N,) on this picture."""
        square = np.minimum((y / SIDE).astype(np.int64), len(self.corners) - 1)
        corner = self.corners[square]
        return self.camera.rays(x + corner[:, 0], y - square * SIDE + corner[:, 1], pixels, samples)

    def screen(self, x: Integers, y: Integers) -> tuple[Floats, Floats]:
        """Bounds on the camera's screen of the squares that a rectangle of this picture touches.

        Those of columns `x` (2,), left before right, and rows `y` (2,), lower before upper.
        """
        touched = self.corners[int(y[1]) // SIDE : -(-int(y[0]) // SIDE)]
        left, top = touched.min(axis=0)
        right, bottom = touched.max(axis=0)
        return self.camera.screen(np.array([left + x[0], right + x[1]]), np.array([bottom + SIDE, top]))

    def places(self, pixels: Integers) -> Integers:
        """Where pixels of the picture are in this one, if they are: columns, rows and anything else."""
        columns, rows = pixels[:2]
        square = self._numbers[rows // SIDE, columns // SIDE]
        inside = square >= 0
        found = np.stack([columns % SIDE, square * SIDE + rows % SIDE, *pixels[2:]])
        return found[:, inside]

    def borders(self) -> Masks:
        """Pixels (H, W) that lie beside a square from elsewhere, or beside none."""
        found = np.zeros((self.height, self.width), dtype=bool)
        found[:, [0, -1]] = True
        found[::SIDE] = True
        found[SIDE - 1 :: SIDE] = True
        return found


def squares(plan: RenderPlan, share: float) -> Squares | None:
    """About this share of a picture; None if it has too few squares to choose from."""
    cells = places.cells(plan.width, plan.height, SIDE, plan.seed)
    whole = [(cell.x0, cell.y0) for cell in cells if cell.width == cell.height == SIDE]
    count = max(FEWEST, round(share * plan.width * plan.height / SIDE**2))
    return Squares(plan.camera, np.array(whole[:count])) if count < len(whole) else None


def part(plan: RenderPlan, seen: Squares) -> RenderPlan:
    """The plan of a picture of these squares."""
    adaptive = plan.adaptive
    if adaptive is not None:
        pilot = None if adaptive.pilot is None else part(adaptive.pilot, seen)
        marked = {name: seen.places(getattr(adaptive, name)) for name in ("thin", "edges", "shadow_edges")}
        adaptive = replace(adaptive, pilot=pilot, **marked)  # type: ignore[arg-type]
    # A camera is what it does: the plan asks no more of it than these squares can tell.
    return replace(plan, camera=seen, adaptive=adaptive)  # type: ignore[arg-type]
