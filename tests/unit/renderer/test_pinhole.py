"""The camera at the ends of its numbers."""

import math

import mpmath
import numpy as np
import pytest

from renderer.arrays import column
from renderer.cameras import pinhole
from renderer.hard_cases.documents import camera, scene
from schemas.cameras import Camera
from schemas.errors import SceneError
from schemas.reading import read_scene

EPS = 2.0**-52


def built(**changes: object) -> pinhole.Pinhole:
    return pinhole.build(Camera.model_validate({"position": [0, 0, 5], "look_at": [0, 0, 0], **changes}))


def centres(view: pinhole.Pinhole) -> np.ndarray:
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    return view.directions(x.ravel(), y.ravel()).T.reshape(view.height, view.width, 3)


def assert_orthonormal(view: pinhole.Pinhole) -> None:
    basis = np.hstack((view.right, view.up, view.forward))
    assert np.abs(basis.T @ basis - np.eye(3)).max() <= 4 * EPS
    assert np.linalg.det(basis) == pytest.approx(-1, abs=1e-14)  # right, up, forward turn left


@pytest.mark.parametrize("up", [[0, 1, 0], [0, -1, 0], [0, 2, 0], [0, 1e-30, 0]])
@pytest.mark.parametrize("look", [[0, -5, 0], [0, 5, 0]])
def test_an_up_along_the_view_is_replaced(up: list[float], look: list[float]) -> None:
    """By the world axis with the smallest share of the view; of equal ones the first."""
    view = built(position=[0, 0, 0], look_at=look, up=up)
    assert_orthonormal(view)
    assert np.abs(view.up - column((1.0, 0.0, 0.0))).max() <= EPS


@pytest.mark.parametrize("tilt", [1e-2, 1e-4, 1e-8])
def test_a_view_nearly_along_up_keeps_its_digits(tilt: float) -> None:
    view = built(position=[0, 0, 0], look_at=[tilt, -1, 0])
    assert_orthonormal(view)
    with mpmath.workdps(50):
        length = mpmath.sqrt(mpmath.mpf(tilt) ** 2 + 1)
        up = [float(1 / length), float(tilt / length), 0.0]
    assert np.abs(view.up.ravel() - up).max() <= 1e-15 / tilt
    assert np.abs(view.right.ravel() - [0, 0, 1]).max() <= 4 * EPS


@pytest.mark.parametrize("scale", [1e-30, 2.0**-70, 1, 1e14])
def test_the_length_of_up_says_nothing(scale: float) -> None:
    assert (centres(built(up=[0, scale, 0])) == centres(built())).all()


def test_a_camera_that_looks_nowhere_is_refused_and_both_fields_named() -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(scene(camera=camera(position=[1, 2, 3], look_at=[1, 2, 3])))
    (problem,) = caught.value.errors
    assert problem.pointer == "/camera/look_at"
    assert "position" in problem.detail
    assert "look_at" in problem.detail


def test_a_camera_that_looks_at_something_immeasurably_near_sees() -> None:
    view = built(position=[0, 0, 0], look_at=[1e-320, 0, -1e-320])
    assert_orthonormal(view)
    assert np.abs(view.forward.ravel() - np.array([1, 0, -1]) / math.sqrt(2)).max() <= 1e-3


@pytest.mark.parametrize("fov", [1e-3, 179.99])
def test_at_the_ends_of_the_field_of_view_all_directions_differ(fov: float) -> None:
    view = built(position=[3, 1, 4], look_at=[1, 5, 9], vertical_fov=fov, width=640, height=3)
    directions = centres(view)
    assert np.isfinite(directions).all()
    assert len(np.unique(directions.reshape(-1, 3), axis=0)) == 640 * 3


def test_a_camera_far_away_has_the_same_directions_bit_for_bit() -> None:
    here = built(position=[0, 0, 0], look_at=[0, 0, -10], vertical_fov=60, width=640, height=480)
    there = built(position=[1e7] * 3, look_at=[1e7, 1e7, 1e7 - 10], vertical_fov=60, width=640, height=480)
    assert (centres(here) == centres(there)).all()
    assert len(np.unique(centres(there)[0, :, 0])) == 640


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


@pytest.mark.parametrize("focal_length", [1e-30, 1.0, 1e14])
def test_the_focal_length_says_nothing(focal_length: float) -> None:
    assert (centres(built(focal_length=focal_length)) == centres(built())).all()
