"""Bump maps and displacement maps: what they do to normals, surfaces and shadows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.shapes import displacement
from tests.pictures import parts

SIZE = 64


def constant(value: float) -> np.ndarray:
    return np.full((SIZE, SIZE), value)


def ramp() -> np.ndarray:
    """Rises with u from 0 at the left border to 1 at the right one."""
    return np.tile((np.arange(SIZE) + 0.5) / SIZE, (SIZE, 1))


def ridge() -> np.ndarray:
    """A wall across u = 1/2."""
    return np.tile(np.abs((np.arange(SIZE) + 0.5) / SIZE - 0.5) < 0.06, (SIZE, 1)).astype(float)


def hills() -> np.ndarray:
    u, v = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
    return 0.5 + 0.25 * np.sin(6 * np.pi * u) + 0.25 * np.cos(4 * np.pi * v)


PANEL = {"type": "rectangle", "center": [0, 0, 0], "normal": [0, 0, 1], "tangent": [1, 0, 0], "size": [4, 2]}
BALL = {"type": "ellipsoid", "center": [0, 0, 0], "radius": 1}
CUBE = {
    "type": "mesh",
    "vertices": [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    "triangles": [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
}  # fmt: skip


def scene(shape: dict[str, Any], *, wrap: str = "clamp", size: int = 24, **material: Any) -> dict[str, Any]:
    texture = {"type": "image", "asset": "map", "encoding": "linear", "filter": "bilinear", "wrap": wrap}
    return {
        "version": 1,
        "camera": {
            "position": [0, 0, 6],
            "look_at": [0, 0, 0],
            "vertical_fov": 40,
            "width": size,
            "height": size,
        },
        "ambient": [1, 1, 1],
        "textures": {"map": texture},
        "materials": {"m": {"type": "phong", "color": [0.8, 0.6, 0.4], "specular": 0.3} | material},
        "shapes": [shape | {"material": "m"}],
        "lights": [{"type": "directional", "direction": [1, 0, -1], "color": [1, 1, 1]}],
    }


def plan_of(heights: np.ndarray, document: dict[str, Any]) -> renderer.RenderPlan:
    """Heights (rows, columns) from 0 to 1, row 0 on the side v = 1."""
    codes = np.floor(heights * 65535 + 0.5).astype(np.uint16)
    return parts.plan_of(document, files={"map": parts.png(codes)})


def picture(heights: np.ndarray, document: dict[str, Any]) -> np.ndarray:
    return renderer.render(plan_of(heights, document)).image


def displaced(shape: dict[str, Any], heights: np.ndarray, height: float, **more: Any) -> renderer.RenderPlan:
    return plan_of(heights, scene(shape, displacement_map="map", displacement_height=height, **more))


def test_ramp_tilts_normals_exactly() -> None:
    height = 1.5
    image = picture(ramp(), scene(PANEL, bump_map="map", bump_height=height, specular=0, ambient=0))
    slope = height / 4  # over the width of the panel, in scene units
    normal = np.array([-slope, 0, 1]) / math.hypot(slope, 1)
    cosine = normal @ np.array([-1, 0, 1]) / math.sqrt(2)
    seen = image[12, 6:18]  # away from the borders, where the clamped ramp is flat
    np.testing.assert_allclose(seen, np.tile(np.array([0.8, 0.6, 0.4]) * cosine, (12, 1)), rtol=2e-4)


def test_bump_from_behind_is_a_dent() -> None:
    front = picture(ramp(), scene(PANEL, bump_map="map", bump_height=1.5))
    turned = scene(PANEL | {"tangent": [-1, 0, 0], "normal": [0, 0, -1]}, bump_map="map", bump_height=-1.5)
    turned["shapes"][0]["tangent"] = [1, 0, 0]
    np.testing.assert_allclose(picture(ramp(), turned), front, atol=2e-6)


@pytest.mark.parametrize("kind", ["bump", "displacement"])
def test_height_0_changes_no_byte(kind: str) -> None:
    document = scene(BALL, **{f"{kind}_map": "map", f"{kind}_height": 0})
    plan = plan_of(hills(), document)
    assert f"/materials/m/{kind}_height" in [pointer for left in plan.left_out for pointer in left.pointers]
    assert not any(kind in stage.name for stage in plan.describe().stages)
    plain = picture(hills(), scene(BALL))
    assert renderer.render(plan).image.tobytes() == plain.tobytes()


@pytest.mark.parametrize("shape", [PANEL, BALL, CUBE], ids=["rectangle", "ellipsoid", "mesh"])
def test_flat_heights_tilt_nothing(shape: dict[str, Any]) -> None:
    flat = picture(constant(0.7), scene(shape, bump_map="map", bump_height=2.0))
    np.testing.assert_allclose(flat, picture(constant(0.7), scene(shape)), atol=1e-6)


def test_constant_displacement_of_a_plane() -> None:
    plan = displaced(PANEL, constant(1.0), 0.25)
    targets = np.random.default_rng(1).uniform([-1.9, -0.9], [1.9, 0.9], (200, 2))
    origins = np.column_stack((targets, np.full(200, 3.0)))
    hits = renderer.trace(plan, origins, np.tile([0.0, 0.0, -1.0], (200, 1)))
    np.testing.assert_allclose(hits.t, 2.75, rtol=1e-14)
    np.testing.assert_allclose(hits.uv, (targets / [4, 2]) + 0.5, atol=1e-14)
    assert set(hits.shape) == {0}


def test_constant_displacement_of_a_ball() -> None:
    plan = displaced(BALL, constant(1.0), 0.2)
    directions = np.random.default_rng(2).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hits = renderer.trace(plan, 5 * directions, -directions)
    # A chord of angle a stays within 1 - cos(a / 2) of its arc; two of them cross in a facet.
    corners = plan.intersectors[0].family.vertices
    angle = max(
        float(np.arccos(np.clip((corners[i] * corners[(i + 1) % 3]).sum(axis=0) / 1.44, -1, 1)).max())
        for i in range(3)
    )
    radius = 5 - hits.t
    assert radius.max() <= 1.2 * (1 + 1e-12)
    assert radius.min() >= 1.2 * math.cos(angle / 2) ** 2


def test_relief_shades_itself() -> None:
    document = scene(PANEL, size=96, displacement_map="map", displacement_height=0.5, ambient=0.5, specular=0)
    image = picture(ridge(), document)
    # The light comes from the left at 45 degrees: right of the wall at x = 0 it is dark for its height.
    lit, dark = image[48, 20], image[48, 58]
    np.testing.assert_allclose(dark, 0.5 * np.array([0.8, 0.6, 0.4]), rtol=1e-6)
    np.testing.assert_allclose(lit, np.array([0.8, 0.6, 0.4]) * (0.5 + math.sqrt(0.5)), rtol=1e-5)


def test_displacement_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(displacement, "MAX_TRIANGLES", 1000)
    for shape in (PANEL, BALL, CUBE):
        family = displaced(shape, hills(), 0.1, size=2000).intersectors[0].family
        assert 500 <= family.numbers.size <= 1100
