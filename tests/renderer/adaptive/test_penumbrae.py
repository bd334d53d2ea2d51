"""Soft shadows at target quality, against integrals over the part of a lamp that is visible."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from schemas.quality import TargetQuality
from tests.documents import Json, camera, lamp, phong, rectangle, scene, sphere

Numbers = NDArray[np.float64]

SIDE = 32
EYE, REACH = 1.0, 2.0
"""Height of the camera above the floor, and half of the floor's side in the picture."""
HIGH = 3.0
COLOR = np.array([0.9, 0.6, 0.3])
FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
SCREEN = rectangle([-0.5, HIGH / 2, -0.5], [0, 0, 1], [1, 0, 0])
"""Halfway between floor and lamp and as large: (x, z) on the floor and (u, v) on the lamp do not see each
other where x + u and z + v are within 1 of 0."""
BALL = 0.35


def document(*shapes: Json) -> Json:
    view = camera(position=[0, EYE, 0], look_at=[0, 0, 0], up=[0, 0, -1], width=SIDE, height=SIDE)
    view["vertical_fov"] = float(2 * np.degrees(np.arctan(REACH / EYE)))
    return scene(
        FLOOR,
        *shapes,
        camera=view,
        lights=[lamp([-0.5, HIGH, -0.5], [1, 0, 0], [0, 0, 1], COLOR.tolist(), visible=False)],
        materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1)},
    )


def places() -> tuple[Numbers, Numbers]:
    """Places (x, z) on the floor, four by four in each pixel: (SIDE * 4, SIDE * 4) each."""
    shares = ((np.arange(SIDE * 4) + 0.5) / (SIDE * 4) * 2 - 1) * REACH
    z, x = np.meshgrid(shares, shares, indexing="ij")
    return x, z


def pixels(values: Numbers) -> Numbers:
    return COLOR * values.reshape(SIDE, 4, SIDE, 4).mean(axis=(1, 3))[:, :, None]


NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


def part(x: Numbers, z: Numbers, u: tuple[Numbers, Numbers], v: tuple[Numbers, Numbers]) -> Numbers:
    """Integral of the cosine at the floor over u[0]..u[1] and v[0]..v[1] of the lamp's plane."""
    total = np.zeros_like(x)
    half_u, half_v = (u[1] - u[0]) / 2, (v[1] - v[0]) / 2
    for s, first in zip(NODES, WEIGHTS, strict=True):
        for t, second in zip(NODES, WEIGHTS, strict=True):
            across, along = (u[0] + u[1]) / 2 + s * half_u - x, (v[0] + v[1]) / 2 + t * half_v - z
            total += first * second * HIGH / np.sqrt(across**2 + HIGH**2 + along**2)
    return total * half_u * half_v


@cache
def behind_screen() -> Numbers:
    x, z = places()
    half = np.full_like(x, 0.5)
    hidden = [tuple(np.clip([-1 - place, 1 - place], -0.5, 0.5)) for place in (x, z)]
    return pixels(part(x, z, (-half, half), (-half, half)) - part(x, z, *hidden))


@cache
def behind_ball() -> Numbers:
    """The ball hides a span of each of many lines along u."""
    x, z = places()
    half = np.full_like(x, 0.5)
    hidden = np.zeros_like(x)
    lines = (np.arange(128) + 0.5) / 128 - 0.5
    power = x**2 + (HIGH / 2) ** 2 + z**2 - BALL**2
    a = x**2 - power
    for v in lines:
        b = z * (v - z) - HIGH**2 / 2
        root = np.sqrt(np.maximum((x * b) ** 2 - a * (b**2 - power * (HIGH**2 + (v - z) ** 2)), 0))
        ends = np.sort([(-x * b - root) / a + x, (-x * b + root) / a + x], axis=0)
        low, high = np.where(root > 0, np.clip(ends, -0.5, 0.5), 0.0)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            u = (low + high) / 2 + node * (high - low) / 2
            hidden += weight * (high - low) / 2 * HIGH / np.sqrt((u - x) ** 2 + HIGH**2 + (v - z) ** 2)
    return pixels(part(x, z, (-half, half), (-half, half)) - hidden / lines.size)


SHADOWS = {"screen": (SCREEN, behind_screen), "ball": (sphere([0, HIGH / 2, 0], BALL), behind_ball)}


@pytest.mark.parametrize("error", [4 / 255, 1 / 255, 0.25 / 255])
@pytest.mark.parametrize("name", SHADOWS)
def test_soft_shadow_is_the_exact_integral(name: str, error: float) -> None:
    """The camera stands below what casts the shadow, so nothing but the floor is in the picture."""
    shape, exact = SHADOWS[name]
    expected = exact()
    assert np.ptp(expected[..., 0]) > 0.25
    plan = renderer.compile_scene(document(shape), TargetQuality(mode="target", error=error))
    result = renderer.render(plan)
    away = result.image - expected
    assert np.sqrt((away**2).mean()) <= 1.1 * error
    assert abs(away.mean()) <= error / 4
    # No region is wrong where the mean hides it: a shadow's border, its core, the light around it.
    rows = away.reshape(4, 8, 4, 8, 3).mean(axis=(1, 3, 4))
    assert np.abs(rows).max() <= 1.5 * error


def test_open_light_is_the_exact_integral() -> None:
    """Nothing casts a shadow, so no shadow ray is needed, and no noise is left."""
    x, z = places()
    half = np.full_like(x, 0.5)
    plan = renderer.compile_scene(document(), TargetQuality(mode="target", error=1 / 255))
    result = renderer.render(plan)
    assert np.abs(result.image - pixels(part(x, z, (-half, half), (-half, half)))).max() <= 1 / 255
    assert result.report["rays"]["shadow"] == 0
