"""Random scenes in general position against `literal`, in both precisions."""

import random

import numpy as np
import pytest

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


def vector(chosen: random.Random, reach: float = 2) -> list[float]:
    return [chosen.uniform(-reach, reach) for _ in range(3)]


def axes(chosen: random.Random) -> list[list[float]]:
    """Three perpendicular semi-axes of any lengths, left-handed or right-handed."""
    turned, _ = np.linalg.qr(np.array([vector(chosen) for _ in range(3)]))
    turned[2] *= chosen.choice([-1, 1])
    return [[float(x) * length for x in axis] for axis in turned for length in [chosen.uniform(0.2, 1.6)]]


def uvs(chosen: random.Random) -> list[list[float]]:
    """Half of them mirrored."""
    return [[chosen.random(), chosen.random()] for _ in range(3)]


def shape(chosen: random.Random) -> Json:
    material = chosen.choice(["plain", "glossy", "rough"])
    match chosen.choice(["triangle", "smooth", "rectangle", "ellipsoid", "sphere"]):
        case "triangle":
            return triangle(*(vector(chosen) for _ in range(3)), uvs=uvs(chosen), material=material)
        case "smooth":
            normals = [vector(chosen) for _ in range(3)]
            corners = [vector(chosen) for _ in range(3)]
            return triangle(*corners, normals=normals, uvs=uvs(chosen), material=material)
        case "rectangle":
            return rectangle(vector(chosen), vector(chosen), vector(chosen), material=material)
        case "ellipsoid":
            return ellipsoid(vector(chosen), *axes(chosen), material=material)
        case _:
            return sphere(vector(chosen), chosen.uniform(0.2, 1.5), material=material)


def light(chosen: random.Random) -> Json:
    match chosen.choice(["lamp", "lamp", "bulb", "sun"]):
        case "lamp":
            corner, first, second = (vector(chosen) for _ in range(3))
            sides, seen = chosen.random() < 0.5, chosen.random() < 0.5
            return lamp(corner, first, second, two_sided=sides, visible=seen)
        case "bulb":
            return bulb(vector(chosen))
        case _:
            return sun(vector(chosen))


def any_scene(seed: int) -> Json:
    chosen = random.Random(seed)
    shininess = chosen.choice([0, 3, 30, 300])
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
            "plain": phong(),
            "glossy": phong(specular=0.5, shininess=shininess),
            "rough": phong(specular=0.3, shininess=5, normal_map="bumps"),
        },
        sampling=sampled(1, 9),
    )


@pytest.mark.parametrize("seed", few_of(60, 12))
def test_random_scenes_against_the_tracer(seed: int) -> None:
    """1e-9 in double precision; in single, a dozen roundings of 2**-24 times the power 30.

    No sample is left out.
    """
    document = any_scene(seed)
    expected = np.array(Drawing(read_scene(document)[0], {"bumps.png": BUMPS.tolist()}).samples())
    for quality, bound in ((DOUBLE, 1e-9), (SINGLE, 12 * 30 * 2.0**-24)):
        plan = plan_of(document, quality, files={"bumps.png": png(BUMPS)})
        assert np.abs(samples_of(plan) - expected).max() <= bound
