"""Mirrors and glass in pictures: against the literal drawing, mirrored geometry, and themselves."""

import random
from typing import Any

import numpy as np
import pytest

import renderer
from schemas.reading import read_scene
from tests.documents import (
    Json,
    bulb,
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
from tests.pictures import pictures
from tests.pictures.literal import Drawing
from tests.pictures.parts import DOUBLE, SINGLE, few_of, plan_of, png, samples_of

BUMPS = pictures.bumps()
SILVER = phong([0, 0, 0], ambient=0, diffuse=0, mirror=1)


def vector(chosen: random.Random, reach: float = 2) -> list[float]:
    return [chosen.uniform(-reach, reach) for _ in range(3)]


def shape(chosen: random.Random) -> Json:
    material = chosen.choice(["mirror", "glass", "rough"])
    uvs = [[chosen.random(), chosen.random()] for _ in range(3)]
    a, b, c, *normals = (vector(chosen) for _ in range(6))
    match chosen.choice(["triangle", "smooth", "rectangle", "ellipsoid", "sphere"]):
        case "triangle":
            return triangle(a, b, c, uvs=uvs, material=material)
        case "smooth":
            return triangle(a, b, c, normals=normals, uvs=uvs, material=material)
        case "rectangle":
            return rectangle(a, b, c, material=material)
        case "ellipsoid":
            # Left-handed or right-handed axes of any lengths.
            turned = np.linalg.qr(normals)[0] * [[1], [1], [chosen.choice([-1, 1])]]
            lengths = [chosen.uniform(0.2, 1.6) for _ in range(3)]
            return ellipsoid(a, *(turned * np.array(lengths)[:, None]), material=material)
        case _:
            return sphere(a, chosen.uniform(0.2, 1.5), material=material)


def light(chosen: random.Random) -> Json:
    match chosen.choice(["lamp", "lamp", "bulb", "sun"]):
        case "lamp":
            sides = {name: chosen.random() < 0.5 for name in ("two_sided", "visible")}
            return lamp(*(vector(chosen) for _ in range(3)), **sides)
        case "bulb":
            return bulb(vector(chosen))
        case _:
            return sun(vector(chosen))


def bouncing(seed: int) -> Json:
    """A random scene of mirrors, glass, and mirrors with a normal map, in general position."""
    chosen = random.Random(seed)
    shininess, ior = chosen.choice([0, 3, 30, 300]), chosen.choice([0.7, 1.0, 1.5])
    relief = {"type": "image", "asset": "bumps.png", "encoding": "linear", "filter": "nearest"}
    view = camera(
        position=vector(chosen, 3),
        look_at=[0, 0, 0],
        vertical_fov=chosen.uniform(30, 90),
        width=16,
        height=12,
    )
    return scene(
        *(shape(chosen) for _ in range(chosen.randrange(3, 10))),
        lights=[light(chosen) for _ in range(chosen.randrange(1, 3))],
        camera=view,
        textures={"bumps": relief},
        materials={
            "mirror": phong(mirror=0.4),
            "glass": phong(specular=0.5, shininess=shininess, transmission=0.9, ior=ior),
            "rough": phong(specular=0.3, shininess=5, normal_map="bumps", mirror=0.7, max_depth=3),
        },
        sampling=sampled(1, 9),
    )


@pytest.mark.parametrize("seed", few_of(60, 7))
def test_random_mirrors_and_glass_against_the_tracer(seed: int) -> None:
    """1e-9 after up to five bounces; in single precision a dozen roundings of 2**-24 times the power 30.

    No sample is left out.
    """
    document = bouncing(seed)
    expected = np.array(Drawing(read_scene(document)[0], {"bumps.png": BUMPS.tolist()}).samples())
    for quality, bound in ((DOUBLE, 1e-9), (SINGLE, 12 * 30 * 2.0**-24)):
        plan = plan_of(document, quality, files={"bumps.png": png(BUMPS)})
        assert np.abs(samples_of(plan) - expected).max() <= bound


def furniture(z: float) -> list[Json]:
    """Shapes before a mirror in the plane z = 0, or behind it with z = -1."""
    return [
        sphere([-0.5, 1, 1.25 * z], 0.5, material="red"),
        triangle([0.5, 0.5, 0.5 * z], [1.5, 0.75, z], [0.75, 2, 1.5 * z]),
        rectangle([-2, 0, 0], [4, 0, 0], [0, 0, 3 * z]),
    ]


@pytest.mark.parametrize("light", ["lamp", "bulb", "sun"])
def test_planar_mirror_shows_the_mirrored_scene(light: str) -> None:
    """The picture in a mirror is that of the mirrored scene beyond its frame."""

    def drawn(z: float, *mirror: Json) -> Any:
        lights = {
            "lamp": lamp([-0.5, 3, z * 1.5], [1, 0, 0], [0, 0, z * 0.75]),
            "bulb": bulb([0.25, 2.5, z * 2]),
            "sun": sun([0.25, -1, -z * 0.5]),
        }
        red = phong([0.9, 0.1, 0.1], specular=0.4, shininess=9)
        document = scene(
            *furniture(z),
            *mirror,
            lights=[lights[light]],
            camera=camera(position=[0.3, 1.5, 4], look_at=[0, 1.25, 0], vertical_fov=20),
            sampling=sampled(1, 9),
            materials={"plain": phong(), "red": red, "silver": SILVER},
        )
        return plan_of(document, DOUBLE)

    plan = drawn(1, rectangle([-1, 0.6, 0], [2, 0, 0], [0, 1.2, 0], material="silver"))
    behind = samples_of(drawn(-1))
    x, y = np.meshgrid(np.arange(plan.width) + 0.5, np.arange(plan.height) + 0.5)
    ways = plan.camera.directions(x.ravel(), y.ravel())
    hits = renderer.trace(plan, np.broadcast_to(plan.camera.position, ways.shape).T, ways.T)
    reached = (hits.shape == 3).reshape(plan.height, plan.width)
    assert reached.sum() > 100
    assert len(np.unique(behind.reshape(-1, 3).round(6), axis=0)) > 20
    assert np.abs(samples_of(plan) - behind)[reached].max() <= 1e-9


def nested_glass(depth: int, mirror: float = 0.0, **view: Any) -> Json:
    """Three balls of glass, one in the other, with nothing else that is left to chance."""
    glass = phong(ambient=0, diffuse=0, mirror=mirror, transmission=1 - mirror, max_depth=depth)
    balls = [sphere([0, 1, 0], radius, material="glass") for radius in (1, 0.75, 0.5)]
    materials = {"glass": glass, "plain": phong()}
    return scene(
        *balls,
        rectangle([-4, -0.5, -4], [0, 0, 8], [8, 0, 0]),
        lights=[bulb([2, 5, 3])],
        materials=materials,
        camera=camera(**{"position": [0, 2, 6], "look_at": [0, 1, 0], "vertical_fov": 24, **view}),
        sampling=sampled(1, 1, "center", "uniform"),
    )


def test_bounces_are_free_of_the_rays_beside_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Waves of all rays of a depth, and of eight, where deeper ones go first."""
    plan = plan_of(nested_glass(8, width=5, height=4), DOUBLE)
    whole = samples_of(plan)
    monkeypatch.setattr("renderer.waves.MOST_RAYS", 8)
    assert samples_of(plan).tobytes() == whole.tobytes()


@pytest.mark.parametrize(("mirror", "depth"), [(0.0, 9), (0.4, 6)])
def test_one_ray_for_all_has_their_mean(mirror: float, depth: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over 1,000 paths that are nearly alike, within 5 standard errors: one false alarm in a million."""
    plan = plan_of(nested_glass(depth, mirror, vertical_fov=0.5, width=40, height=25), DOUBLE)
    monkeypatch.setattr("renderer.waves.THROUGHPUT_CUTOFF", 0.0)
    both = samples_of(plan).sum(axis=-1)
    monkeypatch.setattr("renderer.waves.THROUGHPUT_CUTOFF", 2.0**-5)
    differences = samples_of(plan).sum(axis=-1) - both
    error = differences.std(ddof=1) / np.sqrt(differences.size)
    assert 0 < error < both.mean() / 200
    assert abs(differences.mean()) <= 5 * error


def test_glass_leaves_nothing_to_chance_up_to_five_bounces(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of(nested_glass(5, width=6, height=5), DOUBLE)
    both = samples_of(plan)
    monkeypatch.setattr("renderer.waves.THROUGHPUT_CUTOFF", 1.0)
    assert samples_of(plan).tobytes() == both.tobytes()


def test_bounces_have_their_own_light_points() -> None:
    """The same wall seen twice by one camera sample, once in a mirror, is lit by other random points."""
    emitter = plan_of(pictures.of_room(sampling=sampled(4, 4, "random", "random"))).lightings[0].emitter
    first = np.zeros(2, dtype=np.int64)
    points = emitter.points(first, first, np.array([0, 1 << 50], dtype=np.uint64), np.dtype(np.float64))
    for part in points.places(np.arange(2)):
        assert np.ptp(part, axis=1).min() > 0


def between_mirrors(strength: float, bounces: int, **changes: Any) -> Json:
    """A ray that goes up and down between floor and ceiling, both mirrors, and leaves into the background."""
    silver = phong([0, 0, 0], ambient=0, diffuse=0, mirror=strength, max_depth=bounces)
    walls = [rectangle([0, y, -1], [bounces, 0, 0], [0, 0, 2], material="silver") for y in (0, 1)]
    view = camera(position=[0, 0.5, 0], look_at=[1, 1.5, 0], vertical_fov=1, width=1, height=1)
    return scene(*walls, camera=view, materials={"silver": silver}, **changes)


@pytest.mark.parametrize(("strength", "bounces"), [(0.03, 8), (0.5, 40)])
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
        {"lights": [bulb([0, 9, 0], [1, 1, 1])] * 16},
        {"ambient": [1e9, 1, 1]},
    ],
    ids=["falloff", "lamp", "many bulbs", "ambient"],
)
def test_bright_scenes_keep_paths_going(brighter: Json) -> None:
    """Whatever this path finds at its end: a plan does not know what it will see."""
    document = between_mirrors(0.25, 13, background=[1, 1, 1])
    document["shapes"].append(rectangle([-9, 20, -9], [1, 0, 0], [0, 0, 1]))
    document["materials"]["plain"] = phong([1, 1, 1], ambient=1)
    assert np.all(samples_of(plan_of(document, DOUBLE)) == 0)
    assert np.all(samples_of(plan_of(document | brighter, DOUBLE)) == 2.0**-26)


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
