"""Cameras: bases of views along up, far away, of any length, against rational numbers; pictures; lenses."""

import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from renderer.cameras import Pinhole, build_pinhole
from schemas.cameras import Camera
from schemas.reading import read_scene
from tests.documents import camera, sampled, scene
from tests.numerics.families import direction
from tests.numerics.oracle import cross, dot, minus, rational, unit
from tests.numerics.tracing import EPS, mp
from tests.pictures.parts import plan_of

Floats = np.ndarray
Pose = tuple[list[float], list[float], list[float]]
"""Position, look_at and up."""


def built(**changes: Any) -> Pinhole:
    return build_pinhole(Camera.model_validate({"position": [0, 0, 5], "look_at": [0, 0, 0], **changes}))


def basis_of(pose: Pose) -> Floats:
    """Right, up and forward as rows."""
    view = built(**dict(zip(("position", "look_at", "up"), pose, strict=True)))
    return np.hstack((view.right, view.up, view.forward)).T


def check_basis(pose: Pose) -> None:
    """4 eps from orthonormal, 5 eps over the sine between view and up from true."""
    position, look_at, up = pose
    look, above = minus(rational(look_at), rational(position)), rational(up)
    right = cross(look, above)
    sine = math.sqrt(dot(right, right) / (dot(look, look) * dot(above, above)))
    true = np.array([unit(right), unit(cross(right, look)), unit(look)])
    found = basis_of(pose)
    assert np.abs(found @ found.T - np.eye(3)).max() <= 4 * EPS
    assert np.abs(found - true).max() * sine <= 5 * EPS
    assert np.linalg.det(found * [[1], [1], [-1]]) > 0


def whole(chosen: random.Random) -> list[float]:
    return [float(chosen.randint(-9, 9)) for _ in range(3)]


@pytest.mark.parametrize("tilt", [0, 0.99e-9, 1.01e-9])
def test_up_gives_way_where_a_warning_says_so(tilt: float) -> None:
    """Along -z the axis x is taken in its place; tilted along y, up is y."""
    view = camera(position=[0, 0, 0], look_at=[0, 0, -1], up=[0, tilt, -1])
    document, warnings = read_scene(scene(camera=view))
    up = build_pinhole(document.camera).up.ravel().tolist()
    warned = [warning.pointer for warning in warnings if warning.code == "up_parallel_to_view"]
    assert (up, warned) == (([1, 0, 0], ["/camera/up"]) if tilt < 1e-9 else ([0, 1, 0], []))


def test_up_nearly_along_the_view_keeps_its_digits() -> None:
    """Angles from 1e-8 to 1e-2, in any direction and from any place."""
    chosen = random.Random("nearly")
    for _ in range(200):
        up, aside = np.array(direction(chosen)), np.array(direction(chosen))
        tilt = 10 ** chosen.uniform(-8, -2) / float(np.linalg.norm(np.cross(up, aside)))
        position = np.array(whole(chosen))
        look_at = position + chosen.uniform(1, 100) * (chosen.choice([-1, 1]) * up + tilt * aside)
        check_basis((position.tolist(), look_at.tolist(), up.tolist()))


@pytest.mark.parametrize("exponent", [-1000, 49])
def test_length_of_up_changes_no_bit(exponent: int) -> None:
    chosen = random.Random("length")
    for _ in range(50):
        position, look_at, up = whole(chosen), direction(chosen), direction(chosen)
        scaled = position, look_at, np.ldexp(up, exponent).tolist()
        assert basis_of(scaled).tobytes() == basis_of((position, look_at, up)).tobytes()
        check_basis(scaled)


def test_camera_a_denormal_from_its_target_has_a_basis() -> None:
    chosen = random.Random("near")
    for _ in range(50):
        check_basis(
            ([0.0, 0.0, 0.0], [chosen.randint(1, 2000) * 5e-324 for _ in range(3)], direction(chosen))
        )


def directions_of(view: Pinhole) -> Floats:
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    return view.directions(x.ravel(), y.ravel()).T.reshape(view.height, view.width, 3)


@pytest.mark.parametrize("length", [1e-100, 1e15])
def test_focal_length_changes_no_direction(length: float) -> None:
    assert (directions_of(built(focal_length=length)) == directions_of(built())).all()


@pytest.mark.parametrize("fov", [1e-3, 179.99])
def test_every_pixel_of_an_extreme_view_has_a_direction_of_its_own(fov: float) -> None:
    view = built(position=[3, 1, 4], look_at=[1, 5, 9], vertical_fov=fov, width=640, height=640)
    directions = directions_of(view)[:10].reshape(-1, 3)
    assert np.isfinite(directions).all()
    assert len(np.unique(directions, axis=0)) == len(directions)


@pytest.mark.parametrize("lens_radius", [0.0, 0.5])
@pytest.mark.parametrize("place", [[1e7] * 3, [9e14, -8e14, 7e14]])
def test_camera_far_away_has_the_same_directions(place: list[float], lens_radius: float) -> None:
    def rays(position: list[float]) -> Floats:
        view = camera(
            position=position,
            look_at=np.add(position, [4, -2, -10]),
            lens_radius=lens_radius,
            width=64,
            height=48,
        )
        sampling = sampled(samples=16, pattern="random")
        pixels = np.arange(64 * 3)
        plan = plan_of(scene(camera=view, sampling=sampling))
        return plan.camera.rays(pixels % 64 + 0.5, pixels // 64 + 0.5, pixels, pixels % 16)[1]

    assert (rays(place) == rays([0.0, 0.0, 0.0])).all()


@pytest.mark.parametrize(("width", "height"), [(8192, 1), (1, 1080), (1, 1), (5, 7)])
def test_pixels_are_square_and_lie_about_the_middle(width: int, height: int) -> None:
    view = built(vertical_fov=50, width=width, height=height)
    side = mp.tan(mp.radians(25))

    def places(count: int) -> Floats:
        parts = (Fraction(2 * i + 1 - count, height) for i in range(count))
        return np.array([float(side * part.numerator / part.denominator) for part in parts])

    directions, x, y = directions_of(view), places(width), -places(height)
    assert (np.abs(directions[..., 0] - x) <= 4 * EPS * np.abs(x)).all()
    assert (np.abs(directions[..., 1] - y[:, None]) <= 4 * EPS * np.abs(y[:, None])).all()
    assert (directions[..., 2] == -1).all()
    assert (directions[:, ::-1, 0] == -directions[..., 0]).all()
    assert (directions[::-1, :, 1] == -directions[..., 1]).all()
