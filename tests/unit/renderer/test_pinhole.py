"""The camera at the ends of its numbers."""

import math

import numpy as np
import pytest

from renderer.cameras import Pinhole, build_pinhole
from schemas.cameras import Camera

EPS = 2.0**-52


def built(**changes: object) -> Pinhole:
    return build_pinhole(Camera.model_validate({"position": [0, 0, 5], "look_at": [0, 0, 0], **changes}))


def centres(view: Pinhole) -> np.ndarray:
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    return view.directions(x.ravel(), y.ravel()).T.reshape(view.height, view.width, 3)


@pytest.mark.parametrize(("width", "height"), [(1920, 1), (1, 1080), (1, 1), (3, 2), (2, 3), (5, 7)])
def test_pixels_are_square_and_lie_about_the_middle(width: int, height: int) -> None:
    view = built(vertical_fov=50, width=width, height=height)
    directions = centres(view)
    step = 2 * math.tan(math.radians(25)) / height
    x = (np.arange(width) - (width - 1) / 2) * step
    y = ((height - 1) / 2 - np.arange(height)) * step
    bound = 4 * EPS * max(width, height) * step
    assert np.abs(directions[..., 0] - x).max() <= bound
    assert np.abs(directions[..., 1] - y[:, None]).max() <= bound
    assert (directions[..., 2] == -1).all()
    assert np.abs(directions[:, ::-1, 0] + directions[..., 0]).max() <= EPS * view.half_width
    assert np.abs(directions[::-1, :, 1] + directions[..., 1]).max() <= EPS * view.half_height
    if width % 2 and height % 2:
        assert (directions[height // 2, width // 2] == view.forward.ravel()).all()


def test_the_corners_of_the_picture_are_the_edges_of_the_view() -> None:
    view = built(vertical_fov=90, width=200, height=100)
    corners = view.directions(np.array([0.0, 200.0]), np.array([0.0, 100.0])).T
    assert np.abs(corners - [[-2, 1, -1], [2, -1, -1]]).max() <= 4 * EPS
