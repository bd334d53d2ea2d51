"""Pictures through a lens in target quality: fewer samples, no worse, and the same for any tiles."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import lamp, phong, rectangle, scene, sphere
from schemas.quality import TargetQuality

SIDE = 64


def through(radius: float, *shapes: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A scene of spheres on a floor, through a lens in focus at a distance of 6."""
    view = {
        "position": [0, 1.2, 6],
        "look_at": [0, 0.8, 0],
        "vertical_fov": 40,
        "lens_radius": radius,
        "focus_distance": 6,
        "width": SIDE,
        "height": SIDE,
    }
    floor = rectangle([-15, 0, 11], [30, 0, 0], [0, 0, -30])
    parts = shapes or (sphere([-0.9, 0.7, 2.5], 0.7), sphere([0.8, 0.8, -3], 0.8))
    materials = {"plain": phong(color=[0.7, 0.5, 0.3])}
    return (
        scene(floor, *parts, camera=view, lights=[lamp([1, 5, 4], [2, 0, 0], [0, 0, 2])], materials=materials)
        | more
    )


def plan_of(document: dict[str, Any], error: float) -> renderer.RenderPlan:
    return renderer.compile_scene(document, TargetQuality(mode="target", error=error))


@pytest.mark.parametrize("tile_size", [16, 23])
def test_lens_picture_is_free_of_tiles(tile_size: int) -> None:
    plan = plan_of(through(0.3), 4 / 255)
    assert np.array_equal(
        renderer.render(plan).image, renderer.render(plan, tile_size=tile_size, workers=1).image
    )


def test_lens_picture_out_of_time() -> None:
    plan = renderer.compile_scene(through(0.3), TargetQuality(mode="target", error=1 / 255, time_limit=1e-3))
    result = renderer.render(plan)
    assert np.isfinite(result.image).all()
    assert (result.image > 0).any(axis=2).mean() > 0.99
    assert result.report["error"]["high"] > 4 / 255
