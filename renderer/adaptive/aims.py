"""First requests of a picture, and the error at which its first passes aim."""

import numpy as np

from renderer.adaptive.levels import Levels
from renderer.plan.plan import RenderPlan, adaptive_part
from schemas.quality import TargetQuality
from schemas.tiles import Tile

FIRST_AIM, NEXT_AIM = 2.0**-8, 0.5
"""With a time limit: the first error aimed at, and each next one as a share of the last."""


def first_levels(plan: RenderPlan, tile: Tile) -> Levels:
    """Levels requested by the first pass for the pixels of a tile, (h, w)."""
    assert isinstance(plan.quality, TargetQuality)
    policy = adaptive_part(plan).policy
    stride = policy.first_stride(plan.width, plan.height)
    want = np.zeros((tile.height, tile.width), dtype=np.uint8)
    nodes = np.s_[-tile.y0 % stride :: stride, -tile.x0 % stride :: stride]
    want[nodes] = policy.first_level(first_aim(plan.quality))
    return want


def first_aim(target: TargetQuality) -> float:
    """The error that the first passes aim at: coarse to begin with where time is short."""
    return target.error if target.time_limit is None else max(target.error, FIRST_AIM)
