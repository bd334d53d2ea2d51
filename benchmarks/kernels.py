"""CPU seconds of the parts of a picture, by the formulas of several plans of it."""

from __future__ import annotations

import dataclasses
import time
from typing import TYPE_CHECKING, Any

import numpy as np

import renderer
from benchmarks.clocks import Clock, clocked
from benchmarks.meshes import ball, plan_of
from benchmarks.textbook.shadows import FlatShadowRays, RoundShadowRays
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.raster import RasterIntersector
from renderer.materials.phong import Diffuse, Highlight
from renderer.shapes.family import Intersector, Location
from renderer.shapes.overlaps import Overlaps
from renderer.tiling import blocks, tiles
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygons import PolygonShadows
from scenes.make_meshes import ply

if TYPE_CHECKING:
    from renderer.plan.plan import RenderPlan

MANY = 10_000
"""Triangles in the tree, about."""

REST = "others"
"""Stages without a formula of their own in the textbooks: colours, ambient light, the lamp that is seen."""


def kernel_of(stage: Any) -> str:
    """What a stage of any of the plans is about."""
    match stage:
        case TreeIntersector():
            return f"nearest hits through a tree of {stage.family.numbers.size:,} triangles"
        case Intersector():
            return f"nearest hits of {stage.family.plural}"
        case Overlaps():
            return "shapes in one place"
        case Location():
            return f"points on {stage.family.plural}"
        case PolygonShadows() | FlatShadowRays():
            kind = "triangles" if len(stage.occluders.corners) == 3 else "rectangles"
            return f"shadows of {kind}"
        case EllipsoidShadows() | RoundShadowRays():
            return "shadows of ellipsoids"
        case Diffuse() | Highlight():
            return "Phong's model"
    return REST


def seconds_of(plan: RenderPlan) -> Clock:
    """CPU seconds of the kernels of one picture, by name."""
    clock: Clock = {"primary rays": _seconds_of_camera(plan)}
    renderer.render(clocked(plan, clock, kernel_of))
    clock.pop(REST, None)
    return clock


def _seconds_of_camera(plan: RenderPlan) -> float:
    """One ray through the middle of each pixel, in the blocks of the renderer."""
    pass_, seconds = plan.passes[1], 0.0
    for tile in tiles(plan, pass_):
        for block in blocks(tile, pass_):
            x, y = (index.astype(np.float64) + 0.5 for index in (block.columns, block.rows))
            pixels, samples = block.rows * plan.width + block.columns, np.zeros_like(block.rows)
            begun = time.process_time()
            plan.camera.rays(x, y, pixels, samples)
            seconds += time.process_time() - begun
    return seconds


def of_many_triangles() -> RenderPlan:
    """Rays that hit a ball of flat triangles through a tree, and that is all."""
    shape = {"type": "mesh", "asset": "ball", "smooth": False, "material": "plain"}
    plan = plan_of(shape, {"ball": ply(*ball(MANY))})
    trees = tuple(stage.tree for stage in plan.intersectors if isinstance(stage, RasterIntersector))
    return dataclasses.replace(plan, intersectors=trees, surfaces=(), lightings=())
