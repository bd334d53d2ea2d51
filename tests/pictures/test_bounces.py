"""Mirrors and glass in pictures: against the literal drawing, mirrored geometry, and themselves."""

import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.math.streams import branch, keys
from schemas.reading import read_scene
from tests.documents import (
    Json,
    bulb,
    camera,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures import pictures
from tests.pictures.literal import Drawing
from tests.pictures.parts import DOUBLE, few_of, plan_of, png, samples_of
from tests.pictures.test_literal_random import BUMPS, any_scene

COLORED = {"plain": phong(), "red": phong([0.9, 0.1, 0.1], specular=0.4, shininess=9)}
SILVER = phong([0, 0, 0], ambient=0, diffuse=0, mirror=1)


def bouncing(seed: int) -> Json:
    """A random scene whose materials are mirrors, glass, and mirrors with a normal map."""
    document = any_scene(seed)
    chosen = random.Random(seed)
    document["materials"]["plain"].update(mirror=0.4)
    document["materials"]["glossy"].update(transmission=0.9, ior=chosen.choice([0.7, 1.0, 1.5]))
    document["materials"]["rough"].update(mirror=0.7, max_depth=3)
    return document


@pytest.mark.parametrize("seed", few_of(40, 8))
def test_random_mirrors_and_glass_against_the_tracer(seed: int) -> None:
    """1e-9 after up to five bounces; no sample is left out."""
    document = bouncing(seed)
    expected = np.array(Drawing(read_scene(document)[0], {"bumps.png": BUMPS.tolist()}).samples())
    plan = plan_of(document, DOUBLE, files={"bumps.png": png(BUMPS)})
    assert np.abs(samples_of(plan) - expected).max() <= 1e-9


def furniture(z: float) -> list[Json]:
    """Shapes before a mirror in the plane z = 0, or behind it with z = -1."""

    def at(x: float, y: float, depth: float) -> list[float]:
        return [x, y, z * depth]

    return [
        sphere(at(-0.5, 1, 1.25), 0.5, material="red"),
        triangle(at(0.5, 0.5, 0.5), at(1.5, 0.75, 1), at(0.75, 2, 1.5)),
        rectangle(at(-2, 0, 0), [4, 0, 0], at(0, 0, 3)),
    ]


@pytest.mark.parametrize("light", ["lamp", "bulb", "sun"])
def test_planar_mirror_shows_the_mirrored_scene(light: str) -> None:
    """What is seen behind a frame is the scene built a second time beyond it, seen without the mirror."""

    def lit(z: float) -> list[Json]:
        kinds = {
            "lamp": lamp([-0.5, 3, z * 1.5], [1, 0, 0], [0, 0, z * 0.75]),
            "bulb": bulb([0.25, 2.5, z * 2]),
            "sun": sun([0.25, -1, -z * 0.5]),
        }
        return [kinds[light]]

    view = {
        "camera": camera(position=[0.3, 1.5, 4], look_at=[0, 1.25, 0], vertical_fov=20),
        "sampling": sampled(1, 9),
        "materials": {**COLORED, "silver": SILVER},
    }
    hidden = rectangle([-1, 0.6, 0], [2, 0, 0], [0, 1.2, 0], material="silver")
    mirrored = samples_of(plan_of(scene(*furniture(1), hidden, lights=lit(1), **view), DOUBLE))
    behind = samples_of(plan_of(scene(*furniture(-1), lights=lit(-1), **view), DOUBLE))
    assert len(np.unique(behind.reshape(-1, 3).round(6), axis=0)) > 20
    plan = plan_of(scene(*furniture(1), hidden, lights=lit(1), **view), DOUBLE)
    reached = by_first_shape(plan, 3)
    assert reached.sum() > 100
    assert np.abs(mirrored - behind)[reached].max() <= 1e-9


def glassy(pattern: str = "random") -> Json:
    materials = {"plain": phong(mirror=0.3), "red": phong([0.9, 0.1, 0.1], transmission=0.8, specular=0.3)}
    ball = sphere([0.4, 1.2, 2.2], 0.7, material="red")
    return scene(
        *furniture(1),
        ball,
        lights=[lamp([-0.5, 3, 1.5], [1, 0, 0], [0, 0, 0.75])],
        materials=materials,
        camera=camera(width=40, height=32),
        sampling=sampled(4, 4, pattern, pattern),
    )


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["uniform", "random"])
def test_bounces_are_free_of_tiles(pattern: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of(glassy(pattern))
    whole = renderer.render(plan).image
    assert renderer.render(plan, tile_size=7).image.tobytes() == whole.tobytes()
    monkeypatch.setattr("renderer.integrator.PAIRS", 256)
    monkeypatch.setattr("renderer.tiling.BLOCK_RAYS", 512)
    assert renderer.render(plan, tile_size=16).image.tobytes() == whole.tobytes()


def test_bounces_have_their_own_light_points() -> None:
    """The same wall seen twice by one camera sample, once in a mirror, is lit by other random points."""
    plan = plan_of(glassy())
    emitter = plan.lightings[0].emitter
    pixels = samples = np.zeros(2, dtype=np.int64)
    points = emitter.points(pixels, samples, np.array([0, 1 << 50], dtype=np.uint64), np.dtype(np.float64))
    u, v = points.places(np.arange(2))
    assert np.ptp(u, axis=1).min() > 0
    assert np.ptp(v, axis=1).min() > 0


def test_camera_hits_keep_their_random_numbers() -> None:
    """Bounces are named in the same counter as lights; the name of no bounce adds nothing."""
    pixels, lights = np.arange(100), np.uint64(3)
    assert np.array_equal(keys(7, 3, pixels, 2), keys(7, np.zeros(100, dtype=np.uint64) + lights, pixels, 2))
    names = branch(np.zeros(3, dtype=np.uint64), 0), branch(np.zeros(3, dtype=np.uint64), 1)
    assert len({0, int(names[0][0]), int(names[1][0]), int(branch(names[0], 0)[0])}) == 4


def test_normal_mapped_mirror_sends_no_ray_below() -> None:
    """A mirror over a black floor that would be seen if a ray went through the mirror."""
    relief = {"type": "image", "asset": "bumps.png", "encoding": "linear", "filter": "nearest"}
    materials = {
        "plain": {**SILVER, "normal_map": "bumps"},
        "red": phong([1, 1, 1], ambient=1, diffuse=0),
    }
    shapes = [
        rectangle([-2, 0.5, -2], [0, 0, 4], [4, 0, 0]),
        rectangle([-90, 0.49, -90], [0, 0, 180], [180, 0, 0], material="red"),
    ]
    view = camera(position=[0, 0.8, 4], look_at=[0, 0.5, 0], vertical_fov=12, width=64, height=8)
    document = scene(
        *shapes,
        materials=materials,
        textures={"bumps": relief},
        camera=view,
        background=[0, 0, 0],
        ambient=[1, 1, 1],
    )
    plan = plan_of(document, DOUBLE, files={"bumps.png": png(pictures.bumps())})
    image = samples_of(plan)
    on_mirror = by_first_shape(plan, 0)
    assert on_mirror.sum() > 50
    assert image[on_mirror].max() == 0


def by_first_shape(plan: renderer.RenderPlan, shape: int) -> np.ndarray:
    """Pixels (H, W) whose centre hits a shape first."""
    x, y = np.meshgrid(np.arange(plan.width) + 0.5, np.arange(plan.height) + 0.5)
    directions = plan.camera.directions(x.ravel(), y.ravel())
    hits = renderer.trace(plan, np.broadcast_to(plan.camera.position, directions.shape).T, directions.T)
    return (hits.shape == shape).reshape(plan.height, plan.width)


def test_light_in_a_mirror() -> None:
    shining = lamp([-5, -5, 2], [10, 0, 0], [0, 10, 0], color=(0.25, 0.5, 0.75))
    document = scene(
        rectangle([-9, -9, 0], [18, 0, 0], [0, 18, 0]),
        lights=[shining],
        materials={"plain": SILVER},
        camera=camera(position=[0, 0, 1], look_at=[0, 0, 0], vertical_fov=20),
    )
    assert np.all(samples_of(plan_of(document, DOUBLE)) == [0.25, 0.5, 0.75])


def test_triangle_edge_on_in_a_mirror() -> None:
    """The middle column of pixels lies in the plane of the triangle, and so do its reflections."""
    floor = rectangle([-8, 0, -8], [0, 0, 16], [16, 0, 0], material="silver")
    upright = triangle([0.5, 0.1, 0], [3, 0.2, 0], [2, 2, 0])
    view = camera(position=[-3, 2, 0], look_at=[0, 0, 0], vertical_fov=30, width=9, height=9)
    materials = {"plain": phong(), "silver": SILVER}
    with_it, without = (
        samples_of(plan_of(scene(floor, *more, materials=materials, camera=view), DOUBLE))
        for more in ([upright], [])
    )
    assert np.array_equal(with_it, without)


def between_mirrors(strength: float, bounces: int, **changes: Any) -> Json:
    """A ray that goes up and down between floor and ceiling, both mirrors, and leaves into the background."""
    silver = phong([0, 0, 0], ambient=0, diffuse=0, mirror=strength, max_depth=bounces)
    walls = [rectangle([0, y, -1], [bounces, 0, 0], [0, 0, 2], material="silver") for y in (0, 1)]
    view = camera(position=[0, 0.5, 0], look_at=[1, 1.5, 0], vertical_fov=1, width=1, height=1)
    return scene(*walls, camera=view, materials={"silver": silver}, **changes)


@pytest.mark.parametrize(("strength", "bounces"), [(0.03, 2), (0.5, 11), (0.5, 40), (0.03, 8)])
def test_path_to_a_bright_light(strength: float, bounces: int) -> None:
    document = between_mirrors(strength, bounces, background=[1e6, 1e6, 1e6])
    assert np.allclose(samples_of(plan_of(document, DOUBLE)), strength**bounces * 1e6, rtol=1e-13, atol=0)


def test_path_ends_below_float32() -> None:
    """Weights of 2^-24 and 2^-26; all along the path there may be 4/3 of what lies beyond the mirrors."""
    for white in (1.0, 0.25):
        for bounces, shown in ((11, 2.0**-22), (13, 0.0)):
            document = between_mirrors(0.25, bounces, background=[white] * 3)
            assert np.all(samples_of(plan_of(document, DOUBLE)) == shown * white)


@pytest.mark.parametrize(
    "brighter",
    [
        {"lights": [{**bulb([0, 9, 0]), "falloff": "physical"}]},
        {"lights": [lamp([-5, 9, 0], [1, 0, 0], [0, 0, 1], color=[1e9, 0, 0])]},
        {"ambient": [1e9, 1, 1]},
    ],
    ids=["falloff", "lamp", "ambient"],
)
def test_bright_scenes_keep_paths_going(brighter: Json) -> None:
    """Whatever this path finds at its end: a plan does not know what it will see."""
    document = between_mirrors(0.25, 13, background=[1, 1, 1])
    document["shapes"].append(rectangle([-9, 20, -9], [1, 0, 0], [0, 0, 1]))
    document["materials"]["plain"] = phong([1, 1, 1], ambient=1)
    assert np.all(samples_of(plan_of(document, DOUBLE)) == 0)
    assert np.all(samples_of(plan_of(document | brighter, DOUBLE)) == 2.0**-26)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_cut_paths_are_below_their_bound(seed: int) -> None:
    """Every ray that is not sent stands for a path that ends no later, and adds up to 2^-24 a channel."""
    document = bouncing(seed)
    for material in document["materials"].values():
        material.update(mirror=0.02, transmission=0.02, max_depth=6)
    document["camera"].update(width=4, height=3)
    plan = plan_of(document, DOUBLE, files={"bumps.png": png(BUMPS)})
    endless = replace(plan, scattering=tuple(replace(stage, faintest=0.0) for stage in plan.scattering))
    rays = [renderer.render(each).report["rays"] for each in (plan, endless)]
    ended = sum(rays[1].values()) - sum(rays[0].values())
    assert ended > 0
    assert np.abs(samples_of(plan) - samples_of(endless)).sum() <= 3 * ended * 2.0**-24


def test_ray_in_a_mirror_ball_reaches_its_limit() -> None:
    """The mirror is hit on its own inner side at every bounce, and never at distance 0."""
    document = scene(
        sphere([0, 0, 0], 2),
        materials={"plain": phong(mirror=1, max_depth=9)},
        camera=camera(position=[0.3, 0.2, 0.7], look_at=[1, 0.3, 0.1], vertical_fov=90),
    )
    assert renderer.render(plan_of(document, DOUBLE)).report["rays"]["mirror"] == 24 * 16 * 9
    one = np.array([0.8 * 1, 0.7 * 0.9, 0.6 * 0.8]) * 0.2
    assert np.allclose(samples_of(plan_of(document, DOUBLE)), 10 * one, rtol=1e-13, atol=0)
