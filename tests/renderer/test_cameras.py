"""A mosaic shows squares of a picture as the whole picture shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.cameras import Mosaic, Pinhole
from renderer.cameras import build_lens as thin_lens
from renderer.cameras import build_pinhole as pinhole
from schemas.cameras import Camera
from schemas.quality import Antialiasing

SIDE = 32
COLUMNS, ROWS = 8, 4
CAMERA = Camera.model_validate(
    {"position": [0, 2, 8], "look_at": [0, 2, 0], "width": COLUMNS * SIDE, "height": ROWS * SIDE}
)
CORNERS = SIDE * np.array([[3, 1], [0, 0], [7, 3], [4, 2], [1, 3]])


@pytest.fixture(params=["pinhole", "lens"])
def whole(request: pytest.FixtureRequest) -> Pinhole:
    if request.param == "pinhole":
        return pinhole(CAMERA)
    lens = CAMERA.model_copy(update={"lens_radius": 0.1})
    return thin_lens(lens, Antialiasing(pattern="sobol", samples=16), seed=3)


@pytest.fixture
def mosaic(whole: Pinhole) -> Mosaic:
    return Mosaic.of(whole, SIDE, CORNERS)


def raster(mosaic: Mosaic) -> tuple[Any, Any, Any, Any]:
    """Places of a mosaic, and where they are in the whole picture."""
    y, x = (index.ravel() for index in np.indices((mosaic.height, mosaic.width)))
    number = y // SIDE
    return x, y, x + CORNERS[number, 0], y % SIDE + CORNERS[number, 1]


def test_mosaic_rays_are_those_of_the_picture(whole: Pinhole, mosaic: Mosaic) -> None:
    x, y, columns, rows = raster(mosaic)
    found = mosaic.rays(x + 0.25, y + 0.75, x, x)
    for part, expected in zip(found, whole.rays(columns + 0.25, rows + 0.75, x, x), strict=True):
        np.testing.assert_array_equal(part, expected)
    directions = whole.directions(columns + 0.25, rows + 0.75)
    np.testing.assert_array_equal(mosaic.directions(x + 0.25, y + 0.75), directions)


def test_mosaic_bounds_hold_all_rays(mosaic: Mosaic) -> None:
    top, bottom = SIDE // 2, 2 * SIDE + 3
    left, right, low, high = mosaic.bounds(3, top, 9, bottom)
    y, x = (index.ravel() for index in np.mgrid[top:bottom, 3:9])
    across, along = mosaic.screen(x + 0.5, y + 0.5)
    assert left < across.min() < across.max() < right
    assert low < along.min() < along.max() < high


def test_mosaic_moves_pixels_with_their_squares(mosaic: Mosaic) -> None:
    columns, rows = (index.ravel() for index in np.mgrid[: COLUMNS * SIDE, : ROWS * SIDE])
    x, y, number = mosaic.places(np.stack((columns, rows, np.arange(columns.size))))
    assert np.unique(x * mosaic.height + y).size == x.size == mosaic.width * mosaic.height
    corner = CORNERS[y // SIDE]
    np.testing.assert_array_equal(columns[number], x + corner[:, 0])
    np.testing.assert_array_equal(rows[number], y % SIDE + corner[:, 1])


def test_mosaic_borders_are_those_of_every_square(mosaic: Mosaic) -> None:
    ring = np.ones((SIDE, SIDE), dtype=bool)
    ring[1:-1, 1:-1] = False
    np.testing.assert_array_equal(mosaic.borders(), np.tile(ring, (len(CORNERS), 1)))
