"""Means of boards over pixels near the horizon, where perspective bends their footprints."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import bulb, camera, phong, rectangle, scene
from renderer.adaptive.levels import PREVIEWED
from renderer.adaptive.neighbours import borders
from renderer.adaptive.rays import camera_rays
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.tile_rendering import render_samples
from renderer.integrator import intersect
from renderer.plan.plan import RenderPlan
from schemas.quality import TargetQuality
from schemas.tiles import Tile

SIDE, PLACES = 48, 4096
GOLDEN = (np.sqrt(5) - 1) / 2


def board(error: float, **texture: Any) -> RenderPlan:
    """A large board, whose horizon crosses the picture."""
    fields = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [64, 64], **texture}
    document = scene(
        rectangle([-64, 0, -128], [128, 0, 0], [0, 0, 128]),
        camera=camera(position=[0.3, 1.2, 1], look_at=[0, 0.6, -8], vertical_fov=50, width=SIDE, height=SIDE),
        materials={"plain": phong(ambient=1, diffuse=0, color_texture="board")},
        textures={"board": fields},
        lights=[bulb([0, 5, 0])],
    )
    return renderer.compile_scene(document, TargetQuality(mode="target", error=error))


def sampled(plan: RenderPlan, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Mean of the red colours that lattices of `PLACES` rays through pixels (n,) hit."""
    total = np.zeros(rows.size)
    for place in range(PLACES):
        across, along = (place + 0.5) / PLACES, place * GOLDEN % 1
        places = np.full(rows.size, across), np.full(rows.size, along)
        rays = camera_rays(plan, columns, rows, np.zeros(rows.size, np.int64), places)
        points = intersect(plan, rays, lights=False)
        assert points.count == rows.size
        total += points.colors[0]
    return total / PLACES


@pytest.mark.slow
@pytest.mark.parametrize("error", [2.0**-8, 2.0**-11])
def test_pixel_means_are_as_exact_as_the_target(error: float) -> None:
    """Pixels that the board fills. The lattice's own error is a few over `PLACES` for each edge."""
    plan = board(error)
    none = np.zeros((SIDE, SIDE), np.uint8)
    found = render_samples(
        plan, TileRequest(Tile(0, 0, 0, SIDE, SIDE), LevelRequest.first(none + np.uint8(PREVIEWED)))
    )
    labels = found.labels.reshape(none.shape)
    rows, columns = np.nonzero((labels == 0) & ~borders(labels))
    means = found.colors[0].reshape(none.shape)[rows, columns]
    assert ((means > 0.05) & (means < 0.95)).sum() > rows.size / 4
    errors = means - sampled(plan, rows, columns)
    assert np.sqrt((errors**2).mean()) <= error / 2 + 2 / PLACES
