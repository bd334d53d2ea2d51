"""Cameras: what the counts of the hard cases do not say of them."""

import math

import numpy as np
import pytest

from accuracy.hard_cases.cameras import centres, view_of
from accuracy.hard_cases.documents import Json, camera, scene
from renderer.cameras import Pinhole, build_pinhole
from schemas.cameras import Camera
from schemas.errors import SceneError
from schemas.reading import read_scene
from tests.numerics.tracing import EPS


@pytest.mark.parametrize("tilt", [0, 1e-12, 0.99e-9, 1.01e-9, 1e-8])
def test_another_up_is_taken_exactly_where_a_warning_says_so(tilt: float) -> None:
    """Along -z the first axis, x, is taken in its place; tilted along y, up is y."""
    view = camera(position=[0, 0, 0], look_at=[0, 0, -1], up=[0, tilt, -1])
    document, warnings = read_scene(scene(camera=view))
    up = build_pinhole(document.camera).up.ravel().tolist()
    warned = [warning.pointer for warning in warnings if warning.code == "up_parallel_to_view"]
    assert (up, warned) == (([1, 0, 0], ["/camera/up"]) if tilt < 1e-9 else ([0, 1, 0], []))


def test_right_up_and_backward_are_a_right_handed_basis() -> None:
    view = build_pinhole(Camera(position=(3, 1, 4), look_at=(1, 5, 9), up=(0.1, 1, -0.3)))
    assert np.linalg.det(np.hstack((view.right, view.up, -view.forward))) == pytest.approx(1, abs=1e-15)


LENS: Json = {"position": [0, 0, 0], "look_at": [0, 0, -1e-101], "lens_radius": 0.1}


def test_a_lens_that_would_be_focused_on_the_camera_itself_is_refused_with_the_cure() -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(scene(camera=camera(**LENS)))
    (problem,) = caught.value.errors
    assert problem.pointer == "/camera"
    assert "Give a 'focus_distance'" in problem.detail


@pytest.mark.parametrize("cure", [{"focus_distance": 3}, {"lens_radius": 0}, {"look_at": [0, 0, -1e-99]}])
def test_each_cure_of_such_a_lens_works(cure: Json) -> None:
    read_scene(scene(camera=camera(**{**LENS, **cure})))


@pytest.mark.parametrize("missing", ["position", "look_at"])
def test_a_lens_beside_a_missing_place_is_no_second_problem(missing: str) -> None:
    view = camera(**LENS)
    del view[missing]
    with pytest.raises(SceneError) as caught:
        read_scene(scene(camera=view))
    assert [problem.pointer for problem in caught.value.errors] == ["/camera"]
    assert missing in caught.value.errors[0].detail


def test_opposite_places_of_any_picture_differ_in_sign_alone() -> None:
    """Within pixels too, in eighths of them."""
    for width, height in ((24, 16), (641, 3), (7, 4096)):
        view = view_of(width=width, height=height)
        x, y = (centre + 3 / 8 for centre in centres(width, height))
        across, down = view.screen(x, y)
        back, up = view.screen(width - x, height - y)
        assert (across == -back).all()
        assert (down == -up).all()


def built(**changes: object) -> Pinhole:
    return build_pinhole(Camera.model_validate({"position": [0, 0, 5], "look_at": [0, 0, 0], **changes}))


def directions_of(view: Pinhole) -> np.ndarray:
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    return view.directions(x.ravel(), y.ravel()).T.reshape(view.height, view.width, 3)


@pytest.mark.parametrize(("width", "height"), [(1920, 1), (1, 1080), (1, 1), (3, 2), (2, 3), (5, 7)])
def test_pixels_are_square_and_lie_about_the_middle(width: int, height: int) -> None:
    view = built(vertical_fov=50, width=width, height=height)
    directions = directions_of(view)
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
