"""Shadow tests as textbooks have them: a ray from the rounded hit, and a fixed distance to step over."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from accuracy.hard_cases.documents import Json
from accuracy.hard_cases.formulas import Formula, closed_parallelogram, moeller_trumbore
from accuracy.hard_cases.shadows.scenes import Place, View
from renderer.math.arrays import Floats, Masks

STEP = 1e-4
"""A usual distance to step over, scene units."""


def self_shadowed(view: View, place: Place, height: float, dtype: Any, step: float = 0.0) -> Masks:
    """Rays (N,) whose hit on the plane `height` above a place lies in the shadow of that very plane."""
    normal, anchor = place.axes[2].astype(dtype), place.at(0, 0, height).astype(dtype)
    origins, directions = view.origins.astype(dtype), view.directions.astype(dtype)
    light = np.array(view.lights[0]["position"], dtype=dtype)
    with np.errstate(all="ignore"):
        t = ((anchor - origins) @ normal) / (directions @ normal)
        hits = origins + t[:, None] * directions
        towards = light - hits
        ways = ((anchor - hits) @ normal) / (towards @ normal)
        distances = ways * np.sqrt((towards * towards).sum(axis=1))
        return np.asarray((distances > step) & (ways < 1))


def ball_shades_itself(hits: Floats, place: Place, light: Floats, dtype: Any) -> Masks:
    """Hits (N,) on a ball in a place from which the way to a light hits the ball at some t > 0."""
    away = (hits - place.center).astype(dtype)
    towards = (light - hits).astype(dtype)
    a, b = (towards * towards).sum(axis=1), (away * towards).sum(axis=1)
    root = np.sqrt(np.maximum(b * b - a * ((away * away).sum(axis=1) - dtype(place.unit) ** 2), 0))
    return np.asarray((root - b) / a > 0)


def stepped_over(view: View, share: float, dtype: Any, step: float) -> Masks:
    """Rays (N,) to whose light a cover at a share of the way is nearer than the step."""
    ends = (view.origins + view.directions).astype(dtype)
    towards = np.array(view.lights[0]["position"], dtype=dtype) - ends
    return np.asarray(share * np.sqrt((towards * towards).sum(axis=1)) <= step)


def light_hides_itself(origin: Floats, corner: Floats, first: Floats, second: Floats, dtype: Any) -> Masks:
    """Of 125 points of a light, those that its own plane hides from a place by t < 1."""
    chosen = np.random.default_rng(4)
    u, v = chosen.uniform(0, 1, (2, 125, 1))
    points = (corner + u * first + v * second).astype(dtype)
    normal = np.cross(first, second).astype(dtype)
    towards = points - origin.astype(dtype)
    t = ((corner - origin).astype(dtype) @ normal) / (towards @ normal)
    return np.asarray((t > 0) & (t < 1))


def in_the_way(
    shapes: Sequence[Json], places: Floats, towards: Floats, dtype: Any, step: float = 0.0
) -> Masks:
    """Places (N, 3) with some rectangle, triangle or mesh between `step` and the end of the way (N, 3)."""
    formula, parts = pieces(shapes)
    begins, ways = places.astype(dtype)[:, None], towards.astype(dtype)[:, None]
    with np.errstate(all="ignore"):
        t = formula([part.astype(dtype) for part in parts], begins, ways)
        distances = t * np.sqrt((ways * ways).sum(axis=-1))
    return np.asarray(((distances > step) & (t < 1)).any(axis=1))


def pieces(shapes: Sequence[Json]) -> tuple[Formula, list[Floats]]:
    """The textbook's formula for shapes of one kind, and what it asks of them, each (K, 3)."""
    if shapes[0]["type"] == "rectangle":
        parts = np.array([[shape["corner"], *shape["edges"]] for shape in shapes])
        return closed_parallelogram, list(parts.transpose(1, 0, 2))
    faces = [np.array(each["vertices"])[np.array(each.get("triangles", [[0, 1, 2]]))] for each in shapes]
    return moeller_trumbore, list(np.concatenate(faces).transpose(1, 0, 2))
