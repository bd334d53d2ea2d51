"""Lights that the camera sees fill of pixels what their outlines do, less what is in front of them."""

import numpy as np
import pytest

from accuracy.hard_cases.documents import lamp, rectangle
from tests.renderer.adaptive.test_coverage import (
    BLUE,
    RED,
    SIDE,
    SLANTED,
    Numbers,
    Sheet,
    at,
    covered,
    picture,
    plan_of,
)


def filled(sheet: Sheet) -> Numbers:
    """Share (N,) of each pixel that a sheet fills, to 4e-6: exact along, and in narrow strips across."""
    corner, first, second = np.array(sheet)
    corners = np.array([corner, corner + first, corner + first + second, corner + second])
    strips = 512
    x = (np.arange(SIDE * strips) + 0.5) / strips
    low, high = np.full(x.size, np.inf), np.full(x.size, -np.inf)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        within = (x - x0) * (x - x1) <= 0
        y = y0 + (x - x0) / (x1 - x0) * (y1 - y0)
        low = np.minimum(low, np.where(within, y, np.inf))
        high = np.maximum(high, np.where(within, y, -np.inf))
    rows = np.arange(SIDE)[:, None]
    seen = np.clip(np.minimum(high, rows + 1) - np.maximum(low, rows), 0, 1)
    shares: Numbers = seen.reshape(SIDE, SIDE, strips).mean(axis=2).ravel()
    return shares


@pytest.mark.parametrize(
    "sheet", [SLANTED, ((1.2, 7.05), (13.0, 0.2), (0.01, 0.1)), ((7.31, 7.42), (0.02, 0.01), (-0.01, 0.03))]
)
def test_lights_that_the_camera_sees_fill_what_their_outline_does(sheet: Sheet) -> None:
    """A light of a thousandth of a pixel is known as well as a large one."""
    light = 1000 * RED
    found = covered(plan_of(picture(lights=[lamp(*at(sheet), color=light.tolist())])), 21)
    shares = filled(sheet)
    expected = light[:, None] * shares + BLUE[:, None] * (1 - shares)
    away = np.clip(found.values, 0, 1) - np.clip(expected, 0, 1)
    assert np.abs(away).max() <= 4e-6 * light.max()
    assert (np.abs(found.known - found.values) <= 1e-6 * expected).all()
    assert found.spread.max() <= 1e-6


def test_rays_find_how_much_of_a_light_is_hidden() -> None:
    """A sheet of a hundredth of a unit before a light; by the whole width of what rays find between edges."""
    sheet = (6.0, 6.0), (4.0, 0.0), (0.0, 4.0)
    front = (7.25, 5.0), (5.0, 0.0), (0.0, 8.0)
    corner, first, second = at(front)
    shape = rectangle([corner[0], corner[1], 0.01], first, second)
    plan = plan_of(picture(shape, lights=[lamp(*at(sheet), color=[0.25, 1, 0])]))
    found = covered(plan, 89).values.reshape(3, SIDE, SIDE)[:, 7, 7]
    # Nearer by 0.01 of 8, its edge lies 0.75 / 799 of a pixel farther out.
    share = 0.25 - 0.75 / 799
    expected = np.array([0.25, 1, 0]) * share + RED * (1 - share)
    assert np.abs(found - expected).max() <= 1 / 89
