"""Depth of field against the closed forms of a thin lens."""

import math

import numpy as np
import pytest

from renderer.cameras import ThinLens
from renderer.lights.emitters import PIXEL_DIMENSIONS
from renderer.math.streams import keys
from renderer.samplers import PATTERNS as PATTERN_FUNCTIONS
from tests.documents import (
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures.parts import image_of, plan_of

PATTERNS = ["center", "uniform", "rotated", "random", "stratified", "sobol"]
SIGMAS = 4
"""A right renderer fails one such comparison of normal numbers in 16,000."""


def lens_points(pattern: str, samples: int, pixels: int = 1) -> np.ndarray:
    """Places on the lens of radius 1, (2, pixels, samples)."""
    lens = plan_of(
        scene(camera=camera(lens_radius=1), sampling=sampled(samples=samples, pattern=pattern))
    ).camera
    assert isinstance(lens, ThinLens)
    pixel, sample = np.indices((pixels, samples)).reshape(2, -1)
    return np.stack(lens.places(pixel, sample)).reshape(2, pixels, samples)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_lens_points_fill_the_disk(pattern: str) -> None:
    samples = 1 if pattern == "center" else 16
    x, y = lens_points(pattern, samples, pixels=20000 // samples)
    squared = (x * x + y * y).ravel()
    assert squared.max() <= 1
    # On an even disk the squared radius is uniform on 0..1 and the angle on 0..2 pi; both in eight classes.
    for share in (squared, np.arctan2(y, x).ravel() / (2 * math.pi) + 0.5):
        counts = np.bincount((share * 8).astype(int).clip(0, 7), minlength=8)
        expected = squared.size / 8
        deviation = math.sqrt(squared.size * 1 / 8 * 7 / 8)
        assert np.abs(counts - expected).max() <= SIGMAS * deviation


def test_pixel_and_lens_are_uncorrelated() -> None:
    pixel, sample = np.indices((500, 16)).reshape(2, -1)
    inside, _ = PATTERN_FUNCTIONS["sobol"](keys(0, PIXEL_DIMENSIONS, pixel), sample, 16)
    left = inside.reshape(500, 16) < 0.5
    both = (left & (lens_points("sobol", 16, pixels=500)[0] < 0)).sum(axis=1)
    # Eight of sixteen samples each; Sobol points in the same order would coincide in all eight or in none.
    assert abs(both.mean() - 4) <= SIGMAS * 2 / np.sqrt(500)
    assert ((both > 0) & (both < 8)).mean() > 0.8


def test_plane_in_focus_is_sharp() -> None:
    textures = {"board": {"type": "checker", "repeat": [7, 5]}}
    materials = {"plain": phong(color_texture="board", ambient=1, diffuse=0)}
    board = rectangle([-2, -2, 0], [4, 0, 0], [0, 4, 0])
    view = {"position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov": 50, "width": 40, "height": 30}
    for extra in ({}, {"focus_distance": 5}):
        hole, lens = (
            image_of(scene(board, camera={**view, **more}, textures=textures, materials=materials))
            for more in ({}, {"lens_radius": 0.8, **extra})
        )
        assert np.array_equal(hole, lens)


def spot(depth: float, radius: float, focus: float, samples: int) -> np.ndarray:
    """The picture of a small bright square at some depth on the axis."""
    size = 1e-2 * depth
    light = lamp([-size / 2, -size / 2, -depth], [size, 0, 0], [0, size, 0], color=(1, 1, 1))
    view = camera(position=[0, 0, 0], look_at=[0, 0, -1], vertical_fov=20, width=33, height=33)
    view |= {"lens_radius": radius, "focus_distance": focus}
    settings = sampled(samples=samples, pattern="random", seed=3)
    return image_of(scene(lights=[light], camera=view, background=[0, 0, 0], sampling=settings))[:, :, 0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("depth", "radius", "focus"),
    [(2.0, 0.2, 3.0), (1e3, 0.25, 3.0)],
    ids=["near", "sky"],
)
def test_circle_of_confusion(depth: float, radius: float, focus: float) -> None:
    # The square is brightened by its size on the screen: each sample finds it with a small chance.
    image = spot(depth, radius, focus, samples=4096)
    pixels = 33 / (2 * math.tan(math.radians(10)))
    circle = radius * abs(1 / focus - 1 / depth) * pixels
    y, x = np.indices(image.shape) - 16.0
    seen = np.flatnonzero(image)
    apart = np.hypot(x, y).ravel()
    # All light lies within the circle, but for half the square and half a pixel's diagonal.
    assert apart[seen].max() <= circle + (1e-2 * pixels + 1) / math.sqrt(2)
    found = np.rint(image.ravel() * 4096)
    count = found.sum()
    assert count > 100
    # Uniform on a disk: r^2 has mean circle^2 / 2, variance circle^4 / 12. Pixels and the square widen it.
    widened = circle**2 / 2 + (1 + (1e-2 * pixels) ** 2) / 6
    deviation = math.sqrt(circle**4 / 12 + circle**2 / 3 + 1) / math.sqrt(count)
    assert (found * apart**2).sum() / count == pytest.approx(widened, abs=SIGMAS * deviation)


def crowd(**lens: object) -> dict:
    """Shapes of all kinds, near and far, many of them at the borders of blocks."""
    shapes = [
        *(sphere([x, y, z], 0.3) for x in (-3, 0, 3) for y in (0, 2) for z in (-4, 0, 3)),
        *(triangle([x, 3, 1], [x + 0.7, 3, 2], [x, 3.9, 0]) for x in (-2.0, -0.5, 1.0)),
        rectangle([-5, -0.5, -6], [0, 0, 12], [10, 0, 0]),
        ellipsoid([0.2, 1, 4.5], [0.3, 0, 0], [0, 0.1, 0], [0, 0, 0.6]),
    ]
    view = camera(position=[0, 1.5, 6], look_at=[0, 1, 0], width=64, height=48, **lens)
    return scene(
        *shapes, lights=[sun([-1, -3, -1])], camera=view, sampling=sampled(samples=16, pattern="sobol")
    )


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "focus"), [(1e-3, 6.1), (0.2, 1e6), (1.5, 0.5)])
def test_lens_with_and_without_culling(radius: float, focus: float) -> None:
    document = crowd(lens_radius=radius, focus_distance=focus)
    assert np.array_equal(image_of(document), image_of(document, culling=False))


def test_lens_inside_an_ellipsoid() -> None:
    ball = sphere([0, 0, 0], 1)
    view = camera(
        position=[0, 0, 1.2], look_at=[0, 0, 0], lens_radius=2, focus_distance=10, width=4, height=4
    )
    settings = {"camera": view, "ambient": [0, 0, 0], "lights": [sun([0, 0, -1])]}
    plan = plan_of(scene(ball, **settings))
    assert any(stage.name == "shadows of ellipsoids" for stage in plan.describe().stages)
