"""Phong: highlights of any exponent against 50 digits, back faces, and normals that face away.

Highlights are of a floor in the plane y = 0 under a sun: normal, light and viewer are the numbers of the
scene, so the exact colour is one formula of them.
"""

from typing import Any

import numpy as np
import pytest

from renderer.materials.optics import reflected
from renderer.math.arrays import dot, unit
from tests.documents import Json, dark_scene, lamp, phong, rectangle, sampled, sun, triangle
from tests.numerics.tracing import EPS, QUALITIES, UP, eps_of, mp, radiance
from tests.pictures.parts import plan_of

Floats = np.ndarray
STRENGTH = 0.75
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
LAMP = lamp([-1, 0.5, -1], [2, 0, 0], [0, 0, 2], [1, 1, 1], visible=False)
"""Its reflection in the floor reaches past the horizon of most viewers."""
BOTH = pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])


def highlights(light: Json, viewers: Floats, shininess: float, quality: Any) -> Floats:
    """Radiance of highlights alone towards viewers (3, N)."""
    shiny = phong(ambient=0.0, diffuse=0.0, specular=STRENGTH, shininess=shininess)
    document = dark_scene(FLOOR, lights=[light], materials={"plain": shiny}, sampling=sampled(1, 16))
    return radiance(plan_of(document, quality), viewers, -viewers)[0]


def shining_from(light: Floats) -> Json:
    return sun(-light[:, 0], [1, 1, 1])


def lights(count: int, seed: int) -> list[Floats]:
    """Directions (3, 1) above the floor, at least 10 degrees."""
    rng = np.random.default_rng(seed)
    height, turn = rng.uniform(0.2, 0.95, count), rng.uniform(0, 2 * np.pi, count)
    across = np.sqrt(1 - height**2)
    directions = np.stack((across * np.cos(turn), height, across * np.sin(turn)))
    return [directions[:, i : i + 1] for i in range(count)]


def mirrored(light: Floats) -> Floats:
    """The direction in which the floor reflects a light: two signs, without any rounding."""
    return light * np.array([[-1.0], [1.0], [-1.0]])


def away_from(axis: Floats, cosines: Floats, seed: int) -> Floats:
    """Directions (3, n) above the floor at angles to an axis whose cosines (N,) are given, n of N."""
    turn = np.random.default_rng(seed).uniform(-1, 1, cosines.size)
    beside, above = unit(np.cross(axis, UP, axis=0)), unit(UP - axis * dot(axis, UP))
    across = np.cos(turn) * above + np.sin(turn) * beside
    directions = cosines * axis + np.sqrt((1 - cosines) * (1 + cosines)) * across
    return directions[:, directions[1] > 0.01]


@BOTH
def test_exponent_0_is_a_step_at_the_horizon_of_the_mirrored_light(quality: Any) -> None:
    depth = np.random.default_rng(1).uniform(-3, 3, 100)
    level = np.stack((np.ones(100), np.ones(100), depth))
    # A cosine of exactly 0, and a light from below.
    for light in (np.array([[1.0], [1.0], [0.0]]), -UP + [[0.3], [0.0], [0.1]]):
        assert not highlights(shining_from(light), level, 0.0, quality).any()
    for light in lights(4, 2):
        for cosines, expected in (
            (-(10.0 ** np.linspace(-6, 0, 50)), 0.0),
            (np.linspace(1e-6, 1, 50), STRENGTH),
        ):
            viewers = away_from(mirrored(light), cosines, 4)
            assert (highlights(shining_from(light), viewers, 0.0, quality) == expected).all()


@BOTH
@pytest.mark.parametrize("shininess", [0.0, 0.5, 50.5])
def test_lamp_mirrored_past_the_horizon_counts_by_its_points(shininess: float, quality: Any) -> None:
    """Within 50 roundings times the exponent of the mean over its points."""
    viewers = unit(np.random.default_rng(15).normal(size=(3, 300)))
    viewers[1] = np.abs(viewers[1]) + 2.0**-7
    u = 2 * (np.arange(4) + 0.5) / 4 - 1
    corners = np.stack([part.ravel() for part in np.meshgrid(u, [0.5], u)])
    cosines = np.array([dot(mirrored(unit(place)), unit(viewers)) for place in corners.T[:, :, None]])
    expected = STRENGTH * ((cosines > 0) * np.maximum(cosines, 0) ** shininess).mean(axis=0)
    off = np.abs(highlights(LAMP, viewers, shininess, quality) - expected)
    assert off.max() <= 50 * shininess * eps_of(quality)


def test_grazing_reflection_is_exact() -> None:
    """Cosines from 1e-12 to 0.1, at normals in any direction: length to 4 eps, components to 8."""
    rng = np.random.default_rng(10)
    normals = unit(rng.normal(size=(3, 500)))
    along = unit(np.cross(normals, rng.normal(size=(3, 500)), axis=0))
    viewers = unit(along + normals * 10 ** rng.uniform(-12, -1, 500))
    found = reflected(viewers, normals, normals)
    assert np.abs(np.sqrt(dot(found, found)) - 1).max() <= 4 * EPS
    for viewer, normal, way in zip(viewers.T, normals.T, found.T, strict=True):
        v, n = (
            mp.matrix(vector.tolist()) / mp.norm(mp.matrix(vector.tolist())) for vector in (viewer, normal)
        )
        true = 2 * (v.T * n)[0] * n - v
        assert max(abs(true[i] - float(way[i])) for i in range(3)) <= 8 * EPS


@BOTH
def test_shading_normal_that_faces_away_is_bent_to_the_horizon(quality: Any) -> None:
    """Normals tilt by 150 degrees along an edge; light from above goes by the bent one."""
    rng = np.random.default_rng(12)
    for light in lights(8, 13):
        turn, height, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.9), np.radians(150)
        viewer = np.array([[np.sqrt(1 - height**2)], [height], [0.0]])
        last = np.array([[np.sin(tilt) * np.cos(turn)], [np.cos(tilt)], [np.sin(tilt) * np.sin(turn)]])
        share = (np.arange(200) + 0.5) / 200
        floor = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], normals=[[0, 1, 0], [0, 1, 0], last[:, 0]])
        targets = np.stack((-4 + 8 * share, np.zeros(200), np.full(200, -4 + 2.0**-20)))
        normals = unit((1 - share) * UP + share * last)
        cosines = dot(normals, viewer)
        across = np.where(cosines < 0, np.sqrt((1 - cosines) * (1 + cosines)), 1.0)
        bent = np.where(cosines < 0, unit(normals - viewer * cosines), normals)
        for towards in (light, -light):
            plan = plan_of(dark_scene(floor, lights=[shining_from(towards)]), quality)
            seen = radiance(plan, targets + viewer, np.repeat(-viewer, 200, axis=1))[0]
            expected = np.maximum(dot(bent, towards), 0) * (towards[1] > 0)
            assert (np.abs(seen - expected) <= 64 * eps_of(quality) / across).all()
