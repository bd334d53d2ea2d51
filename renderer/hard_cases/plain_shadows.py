"""Shadow tests as textbooks have them: a ray from the rounded hit, and a fixed distance to step over."""

from typing import Any

import numpy as np

from renderer.arrays import Floats, Masks
from renderer.hard_cases.shadow_scenes import Place, View

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
