"""Depth of field: points on the lens, and what is in focus."""

import math

import numpy as np
import pytest

from renderer.cameras import ThinLens
from tests.documents import camera, phong, rectangle, sampled, scene
from tests.pictures.parts import image_of, plan_of

PATTERNS = ["center", "uniform", "rotated", "random", "stratified", "sobol"]
SIGMAS = 4
"""A right renderer fails one such comparison of normal numbers in 16,000."""


@pytest.mark.parametrize("pattern", PATTERNS)
def test_lens_points_fill_the_disk(pattern: str) -> None:
    samples = 1 if pattern == "center" else 16
    document = scene(camera=camera(lens_radius=1), sampling=sampled(samples=samples, pattern=pattern))
    lens = plan_of(document).camera
    assert isinstance(lens, ThinLens)
    x, y = lens.places(*np.indices((20000 // samples, samples)).reshape(2, -1))
    squared = x * x + y * y
    assert squared.max() <= 1
    # On an even disk the squared radius is uniform on 0..1 and the angle on 0..2 pi; both in eight classes.
    for share in (squared, np.arctan2(y, x) / (2 * math.pi) + 0.5):
        counts = np.bincount((share * 8).astype(int).clip(0, 7), minlength=8)
        expected = squared.size / 8
        deviation = math.sqrt(squared.size * 1 / 8 * 7 / 8)
        assert np.abs(counts - expected).max() <= SIGMAS * deviation


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
