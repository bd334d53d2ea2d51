"""Normal maps: texels and tangents that say nothing, flat maps, and frames at the lower pole."""

from typing import Any

import numpy as np
import pytest

from renderer.math.arrays import dot, unit
from renderer.shapes.frames import frame_of_normals
from tests.documents import rectangle, triangle
from tests.numerics.test_textures import mapped
from tests.numerics.tracing import EPS, UP, points

Floats = np.ndarray
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
SILENT = 1e-3
"""Squared length of a decoded texel below which it is no direction: grey 128 has 4.6e-5."""


def texels() -> Any:
    """Texels (1, N, 3): all greys near the middle, flat, inward, black ones, and random ones."""
    near = np.stack(np.meshgrid(*[np.arange(125, 132)] * 3), axis=-1).reshape(-1, 3)
    special = [(128, 128, 255), (0, 0, 0), (128, 128, 0), (255, 0, 0), (0, 0, 255), (255, 255, 255)]
    return np.vstack((near, special, np.random.default_rng(2).integers(0, 256, (300, 3))))[None]


def bent(normals: Floats, viewers: Floats) -> tuple[Floats, Floats]:
    """Normals (3, N) bent to the horizon of viewers, and the sines that their errors grow by."""
    cosines = dot(normals, viewers)
    sines = np.where(cosines < 0, np.sqrt((1 - cosines) * (1 + cosines)), 1.0)
    return np.where(cosines < 0, unit(normals - viewers * cosines), normals), sines


@pytest.mark.parametrize("viewer", [[0.1, 0.9, -0.2], [0.7, 0.3, 0.4]], ids=["from above", "aslant"])
def test_texel_that_says_nothing_bends_nothing(viewer: list[float]) -> None:
    """All others do as their decoded direction says, bent to the horizon where it faces away."""
    codes = texels()
    count = codes.shape[1]
    targets = np.stack((np.zeros(count), np.zeros(count), -4 + 8 * (np.arange(count) + 0.5) / count))
    decoded = (2 * (codes[0].T / np.float32(255)).astype(np.float32).astype(np.float64) - 1)[[1, 2, 0]]
    viewers = np.repeat(unit(np.array(viewer)[:, None]), count, axis=1)
    true, sines = bent(np.where(dot(decoded, decoded) < SILENT, UP, unit(decoded)), viewers)
    normals = points(
        mapped(FLOOR, codes=codes, normal_map="map"), targets + viewers, -viewers
    ).shading_normals
    assert (np.abs(normals - true).max(axis=0) <= 16 * EPS / sines).all()
    flat = (codes[0] == (128, 128, 255)).all(axis=1)
    assert (normals[1, flat] >= np.cos(np.radians(0.4))).all()


def test_grey_between_127_and_128_bends_nothing() -> None:
    codes = np.where(np.arange(40) % 2 == 0, 127, 128)[None, :, None].repeat(3, axis=2)
    plan = mapped(FLOOR, codes=codes, filter_="bilinear", normal_map="map")
    targets = np.stack((np.zeros(39), np.zeros(39), -4 + 8 * np.arange(1, 40) / 40))
    assert (points(plan, targets + UP, np.repeat(-UP, 39, axis=1)).shading_normals == UP).all()


def test_grey_map_on_a_smooth_mesh_changes_nothing() -> None:
    rng, share = np.random.default_rng(3), (np.arange(100) + 0.5) / 100
    targets = np.stack((-4 + 8 * share, np.zeros(100), np.full(100, -4 + 2.0**-20)))
    for _ in range(6):
        last = unit(np.array([[rng.normal()], [-0.6], [rng.normal()]]))
        viewers = np.repeat(unit(np.array([[rng.normal()], [0.4], [rng.normal()]])), 100, axis=1)
        smooth = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], normals=[[0, 1, 0], [0, 1, 0], last[:, 0]])
        bare, carved = (
            points(mapped(smooth, codes=np.full((1, 1, 3), 128), **more), targets + viewers, -viewers)
            for more in ({}, {"normal_map": "map"})
        )
        _, sines = bent(unit((1 - share) * UP + share * last), viewers)
        off = np.abs(bare.shading_normals - carved.shading_normals).max(axis=0)
        assert (off <= 8 * EPS / sines).all()


def test_frame_near_the_lower_pole_is_orthonormal() -> None:
    """1e-7 to 0.1 from straight down, straight down itself, and the normal that pbrt tests."""
    rng = np.random.default_rng(4)
    tilt, turn = 10 ** rng.uniform(-7, -1, 1000), rng.uniform(0, 2 * np.pi, 1000)
    down = np.stack((np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)))
    known = np.array([[0.0, -0.0, 0.00038527316], [0.0, 0.0, 0.00038460016], [-1.0, -1.0, -0.99999988079]])
    normals = np.hstack((down, unit(known)))
    tangents = frame_of_normals(normals)
    assert np.abs(dot(tangents, normals)).max() <= 8 * EPS
    assert np.abs(dot(tangents, tangents) - 1).max() <= 8 * EPS


@pytest.mark.parametrize("uvs", [[[0, 0], [1, 0], [0, 1]], [[0.5, 0.5]] * 3, [[0, 0], [1, 1], [2, 2]]])
def test_tangent_that_says_nothing_still_makes_a_frame(uvs: Any) -> None:
    """Smooth normals within 1e-7 of the tangent or on it, and uv on a point or a line."""
    rng, texel = np.random.default_rng(5), np.array([200, 150, 225])
    decoded = 2 * (texel / 255).astype(np.float32).astype(np.float64) - 1
    height = decoded[2] / np.sqrt(decoded @ decoded)
    for number in range(20):
        aside = unit(np.array([[rng.normal()], [abs(rng.normal())], [0.0]]))
        smooth = unit(np.array([[0.0], [0.0], [1.0]]) + (0.0, 10 ** rng.uniform(-16, -7))[number % 2] * aside)
        shape = triangle([-1, 0, -1], [-1, 0, 1], [1, 0, -1], uvs=uvs, normals=[smooth[:, 0]] * 3)
        viewer = unit(smooth + 0.3 * UP)
        plan = mapped(shape, codes=texel[None, None], normal_map="map")
        targets = np.stack((rng.uniform(-0.9, 0, 8), np.zeros(8), rng.uniform(-0.9, 0, 8)))
        normal = points(plan, targets + viewer, np.repeat(-viewer, 8, axis=1)).shading_normals
        assert np.abs(dot(normal, smooth) - height).max() <= 16 * EPS
        assert np.abs(dot(normal, normal) - 1).max() <= 16 * EPS
