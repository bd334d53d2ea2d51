"""Hard cases H: different shapes that overlap in one plane."""

import itertools
from functools import partial

import numpy as np

from accuracy.hard_cases.documents import Json, mesh, rectangle, triangle
from accuracy.hard_cases.harness import Outcome, Section, in_both, tally, total, traced
from accuracy.hard_cases.shadows.plain import pieces
from accuracy.hard_cases.shadows.scenes import SCALES, Place, grid, places
from renderer.math.arrays import Floats, Integers

SECTION = Section("Shapes in one plane")

KINDS = ("rectangle", "triangle", "small mesh", "large mesh")
"""Of what lies in the plane of a rectangle; only the large mesh is in a tree."""

CORNERS = np.array([[-0.7, -0.9], [1.0, -0.4], [0.1, 0.8]])
"""A triangle in the middle of all of them, across and along."""


@SECTION.case(
    "H11: shapes that overlap in one plane",
    symptom="Speckles of two colours where a sign lies on a wall or a mesh on a floor, without any gap.",
    cause="Both are hit at one distance but for rounding, by different formulas, and the nearer is taken.",
    remedy="Shapes that overlap in one plane are found beforehand, and where a ray hits two of them the "
    "first of the scene is taken. Two meshes of over 32 triangles are not compared.",
    expected="The first of the scene at every place of both, in either order, near and far from the origin, "
    "in all units, at angles down to 0.003.",
    source="geometry; for which shapes overlap, Gottschalk, Lin and Manocha 1996, OBBTree",
)
def overlapping_shapes() -> Outcome:
    """A rectangle, and something else in its plane before it or after it in the scene."""
    outcomes = []
    for kind in KINDS:
        for number, (chosen, place) in enumerate(
            itertools.chain(places(f"plane {kind}"), places(f"plane {kind} sizes", (1.0,), SCALES))
        ):
            pair = [rectangle(*_rectangle(place, 2.0)), _other(kind, place)][:: 1 - 2 * (number % 2)]
            targets, origins = _rays(place, chosen)
            ways = targets - origins
            plain = in_both(partial(_plainly, pair, origins, ways))
            found = (traced(pair, origins, ways).shape, *plain)
            outcomes.append(Outcome(len(targets), *(tally(number != 0) for number in found)))
    return total(outcomes)


def _rectangle(place: Place, half: float) -> tuple[Floats, Floats, Floats]:
    return place.at(-half, -half, 0), place.way(2 * half, 0, 0), place.way(half / 3, 2 * half, 0)


def _other(kind: str, place: Place) -> Json:
    if kind == "rectangle":
        return rectangle(*_rectangle(place, 1.5))
    if kind == "triangle":
        return triangle(*place.at(*(1.5 * CORNERS).T, 0))
    steps = np.linspace(-1.4, 1.4, 4 if kind == "small mesh" else 8)
    vertices, faces = grid(place, steps, 0.0)
    return mesh(vertices, faces)


def _rays(place: Place, chosen: np.random.Generator) -> tuple[Floats, Floats]:
    """Places (60, 3) well inside of both shapes, and origins above them."""
    across, along = (chosen.dirichlet([1, 1, 1], 60) @ CORNERS).T
    view, turn = 10 ** chosen.uniform(-2.5, 0, 60), chosen.uniform(0, 2 * np.pi, 60)
    targets = place.at(across, along, 0)
    return targets, targets + 3 * place.way(np.cos(turn), np.sin(turn), view)


def _plainly(pair: list[Json], origins: Floats, ways: Floats, dtype: type[np.floating]) -> Integers:
    """Number of the nearer of two shapes, the first of equal ones, for rays (N, 3)."""
    begins, along = origins.astype(dtype)[:, None], ways.astype(dtype)[:, None]
    nearest = []
    for shape in pair:
        formula, parts = pieces([shape])
        nearest.append(formula([part.astype(dtype) for part in parts], begins, along).min(axis=1))
    return np.argmin(np.stack(nearest), axis=0)
