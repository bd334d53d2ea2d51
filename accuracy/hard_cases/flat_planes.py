"""Rays that begin in the plane of a flat shape, or run along it, in whole numbers."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases import flat_formulas
from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.documents import Json, rectangle, scene, triangle
from accuracy.hard_cases.flat_formulas import Formula
from renderer.math.arrays import Floats, Masks, Pairs

SHAPES, RAYS = 100, 10

SMALL = 20
"""Coordinates so small that float32 forms products of three of them exactly."""

LARGE = 2**19
"""Coordinates of which float32 holds eighths of sums exactly, and float64 rounds products of three."""


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A corner and two edges of whole numbers, not parallel, each (3,)."""

    corner: Floats
    first: Floats
    second: Floats

    @property
    def normal(self) -> Floats:
        """Not of length 1, exact."""
        return np.cross(self.first, self.second)

    def combined(self, shares: NDArray[Any]) -> Floats:
        """Sums (N, 3) of the edges by shares (N, 2)."""
        return np.asarray(shares @ np.stack((self.first, self.second)))

    def document(self, kind: str) -> Json:
        """As a shape of a scene."""
        parts = [part.tolist() for part in self.triple(kind)]
        return rectangle(*parts) if kind == "rectangle" else triangle(*parts)

    def triple(self, kind: str) -> list[Floats]:
        """What formulas for the kind ask: vertices, or corner and edges."""
        edges = [self.first, self.second]
        return [self.corner, *(edges if kind == "rectangle" else [self.corner + edge for edge in edges])]


def planes(seed: int, reach: int) -> Iterator[tuple[Plane, np.random.Generator]]:
    """Of a family, with coordinates up to `reach`, each with the stream its rays come from."""
    rng = np.random.default_rng(seed)
    count = 0
    while count < SHAPES:
        plane = Plane(*rng.integers(-reach, reach + 1, (3, 3)).astype(float))
        if plane.normal.any():
            count += 1
            yield plane, rng


def along_the_plane(kind: str) -> Outcome:
    """Rays along the plane, half of them in it. Right is a miss, or in the plane a hit within the shape."""
    return total(_along(kind, plane, rng) for plane, rng in planes(1, SMALL))


def _along(kind: str, plane: Plane, rng: np.random.Generator) -> Outcome:
    directions = plane.combined(rng.integers(-9, 10, (RAYS, 2)))
    directions[~directions.any(axis=1)] = plane.first
    beside = rng.choice([-2, -1, 1, 2], RAYS) * (np.arange(RAYS) % 2)
    origins = plane.corner + plane.combined(rng.integers(-9, 10, (RAYS, 2)))
    origins += np.outer(beside, plane.normal)
    low, high = _depths(plane, origins, directions)

    def right(t: Pairs) -> Masks:
        return np.isinf(t) | ((beside == 0) & (low <= t) & (t <= high))

    formula: Formula = (
        flat_formulas.projected_on_edges if kind == "rectangle" else flat_formulas.moeller_trumbore
    )
    textbook = _asked(formula, plane.triple(kind), origins, directions)
    return _outcome(kind, plane, origins, directions, textbook, right)


def _depths(plane: Plane, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Where the shape begins and ends along rays in its plane, each (N,), a thousandth of it wider."""
    corners = plane.corner + plane.combined(np.array([[0, 0], [1, 0], [0, 1], [1, 1]]))
    depths = ((corners[:, None] - origins) * directions).sum(axis=2) / (directions**2).sum(axis=1)
    low, high = depths.min(axis=0), depths.max(axis=0)
    return low - (high - low) / 1000, high + (high - low) / 1000


def from_the_plane(kind: str) -> Outcome:
    """Rays that begin on the shape, in eighths of its edges, and go anywhere. Right is a miss."""
    return total(_from(kind, plane, rng) for plane, rng in planes(2, LARGE))


def _from(kind: str, plane: Plane, rng: np.random.Generator) -> Outcome:
    shares = rng.integers(0, 9, (RAYS, 2)) / 8
    beyond = shares.sum(axis=1) > 1
    if kind == "triangle":
        shares[beyond] = 1 - shares[beyond]
    origins = plane.corner + plane.combined(shares)
    directions = rng.normal(size=(RAYS, 3))
    textbook = _asked(flat_formulas.normal_form, plane.triple("rectangle"), origins, directions)
    return _outcome(kind, plane, origins, directions, textbook, np.isinf)


def _asked(formula: Formula, triple: list[Floats], origins: Floats, directions: Floats) -> list[Pairs]:
    """Distances (N,) by a formula, in float64 and in float32."""
    with np.errstate(all="ignore"):
        return [
            formula([part.astype(dtype) for part in triple], origins.astype(dtype), directions.astype(dtype))
            for dtype in (np.float64, np.float32)
        ]


def _outcome(
    kind: str,
    plane: Plane,
    origins: Floats,
    directions: Floats,
    textbook: list[Pairs],
    right: Callable[[Pairs], Masks],
) -> Outcome:
    plan = renderer.compile_scene(renderer.load_scene(scene(plane.document(kind))))
    answers = (renderer.trace(plan, origins, directions).t, *textbook)
    return Outcome(RAYS, *(int(np.count_nonzero(~right(t))) for t in answers))
