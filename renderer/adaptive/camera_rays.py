"""Rays through scattered pixels."""

import numpy as np

from renderer.interaction import Rays
from renderer.math.arrays import Floats, Integers
from renderer.plan.plan import RenderPlan


def camera_rays(
    plan: RenderPlan, columns: Integers, rows: Integers, samples: Integers, place: tuple[Floats, Floats]
) -> Rays:
    """Rays of samples (n,) through pixels (n,), at places in them (n,) and (n,)."""
    pixels = rows * plan.width + columns
    origins, directions = plan.camera.rays(columns + place[0], rows + place[1], pixels, samples)
    left, right = plan.camera.screen(
        np.array([columns.min(), columns.max() + 1]), np.array([rows.max() + 1, rows.min()])
    )
    return Rays(origins, directions, pixels, samples, screen=np.concatenate((left, right)))
