"""Seeded tiny scenes of rare combinations end, and give finite pictures: everything the language knows.

Sizes, places and strengths differ by powers of ten, shapes lie in one plane or in each other, and lights are
far brighter than a picture needs: what people write by accident.
"""

import random
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

import renderer
from schemas.api.layers import LAYER_NAMES
from schemas.quality import Quality, TargetQuality
from tests.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    spot,
    sun,
    triangle,
)
from tests.pictures import pictures
from tests.pictures.parts import Files, few_of, png, same

Random = random.Random

FILES = {
    "picture.png": png(pictures.codes(6, 5)),
    "pixel.png": png(pictures.codes(1, 1)),
    "bumps.png": png(pictures.bumps()),
    "mesh.obj": b"v -1 0 0\nv 1 0.2 0\nv 0 1 0.5\nv 0 0.3 -1\nvt 0 0\nvt 1 0\nvt 0 1\n"
    b"f 1/1 2/2 3/3\nf 1/1 4/2 2/3\n",
}


def rare_scene(seed: int) -> Json:
    """A scene that the language accepts."""
    chosen = Random(seed)
    reach = chosen.choice([1.5, 1.5, 1.5, 0.2, 8])
    shapes = [_shape(chosen, reach) for _ in range(chosen.randrange(1, 6))]
    if chosen.random() < 0.7:
        size = chosen.choice([2.0, 50.0, 1e6])
        corner = [-size / 2, chosen.choice([0.0, -0.5]), -size / 2]
        shapes.append(rectangle(corner, [0, 0, size], [size, 0, 0], material="m0"))
    if chosen.random() < 0.15:
        shapes.append({**chosen.choice(shapes), "material": "m1"})
    pattern = chosen.choice(["center", "uniform", "rotated", "random", "stratified", "sobol"])
    return scene(
        *shapes,
        lights=[_light(chosen) for _ in range(chosen.choice([0, 1, 1, 1, 2, 3]))],
        camera=_camera(chosen),
        background=_color(chosen),
        ambient=_color(chosen),
        textures={"a": _texture(chosen), "n": _image(chosen), "h": _image(chosen)},
        materials={f"m{number}": _material(chosen) for number in range(4)},
        sampling=sampled(
            1 if pattern == "center" else chosen.choice([1, 4, 9]),
            chosen.choice([1, 4, 9]),
            pattern,
            chosen.choice(["uniform", "random", "stratified", "sobol"]),
            chosen.choice([0, 1, 2**53 - 1]),
        ),
    )


def _vector(chosen: Random, reach: float = 1.0) -> list[float]:
    return [chosen.choice([0.0, 0.5, chosen.uniform(-1, 1), chosen.uniform(-1, 1)]) * reach for _ in range(3)]


def _direction(chosen: Random, length: float = 1.0) -> list[float]:
    return [chosen.choice([-1.0, 1.0]) * chosen.uniform(0.1, 1) * length for _ in range(3)]


def _color(chosen: Random) -> list[float]:
    strength = chosen.choice([0.0, 0.3, 1.0, 1.0, 50.0])
    return [strength * chosen.choice([0.0, 1.0, chosen.random()]) for _ in range(3)]


def _camera(chosen: Random) -> Json:
    lens: Json = {"lens_radius": chosen.choice([1e-3, 0.1, 1.0])} if chosen.random() < 0.2 else {}
    if lens and chosen.random() < 0.5:
        lens["focus_distance"] = chosen.choice([0.3, 2.0, 100.0])
    return camera(
        position=[chosen.uniform(-1, 1), chosen.uniform(0.1, 3), chosen.choice([0.5, 3.0, 6.0])],
        look_at=[0.1, chosen.uniform(-0.2, 0.6), 0.0],
        vertical_fov=chosen.choice([5, 40, 60, 120, 170]),
        width=chosen.choice([1, 2, 7, 12, 16]),
        height=chosen.choice([1, 3, 5, 9, 12]),
        **lens,
    )


def _texture(chosen: Random) -> Json:
    if chosen.random() < 0.5:
        return _image(chosen)
    repeat = [chosen.choice([0.5, 1.0, 7.3, 400.0]) for _ in range(2)]
    return {"type": "checker", "repeat": repeat, "filter": chosen.choice(["none", "box"])}


def _image(chosen: Random) -> Json:
    return {
        "type": "image",
        "asset": chosen.choice(["picture.png", "pixel.png", "bumps.png"]),
        "encoding": chosen.choice(["srgb", "linear"]),
        "filter": chosen.choice(["nearest", "bilinear", "mipmap"]),
        "wrap": chosen.choice(["clamp", "repeat", "mirror"]),
    }


def _material(chosen: Random) -> Json:
    mirror = chosen.choice([0, 0, 0, 0.1, 0.5, 1])
    sometimes: list[tuple[float, Json]] = [
        (0.3, {"color_texture": "a"}),
        (0.2, {"normal_map": "n"}),
        (0.15, {"bump_map": "h", "bump_height": chosen.choice([0, 0.05, -1.0, 30.0])}),
        (0.15, {"displacement_map": "h", "displacement_height": chosen.choice([0, 1e-3, 0.2, -0.5])}),
        (0.25, {"transmission": 1 - mirror, "ior": chosen.choice([1, 1.5, 0.7, 1.0000001, 50])}),
    ]
    parts = {name: x for share, more in sometimes if chosen.random() < share for name, x in more.items()}
    return phong(
        [chosen.random() for _ in range(3)],
        ambient=chosen.choice([0, 0.1, 1]),
        diffuse=chosen.choice([0, 0.8, 1]),
        specular=chosen.choice([0, 0, 0.5, 20]),
        shininess=chosen.choice([0, 1, 20, 1e4, 1e7]),
        mirror=mirror,
        max_depth=chosen.choice([1, 2, 5]),
        **parts,
    )


def _shape(chosen: Random, reach: float) -> Json:
    material = {"material": chosen.choice(["m0", "m1", "m2", "m3"])}
    center, *corners = (_vector(chosen, reach) for _ in range(4))
    match chosen.choice(["triangle", "smooth", "rectangle", "sphere", "ellipsoid", "grid", "grid", "file"]):
        case "triangle":
            return triangle(*corners, **material)
        case "smooth":
            normals = [_direction(chosen) for _ in range(3)]
            uvs = [[chosen.uniform(-2, 2), chosen.choice([0.0, 1.0])] for _ in range(3)]
            return triangle(*corners, normals=normals, uvs=uvs, **material)
        case "rectangle":
            return rectangle(center, *_edges(chosen), **material)
        case "sphere":
            return sphere(center, chosen.choice([1e-6, 0.1, 0.5, 2.0]), **material)
        case "ellipsoid":
            turned, _ = np.linalg.qr(np.array([_direction(chosen) for _ in range(3)]))
            lengths = [[chosen.choice([1e-3, 0.3, 1.0])] for _ in range(3)]
            return ellipsoid(center, *(turned * lengths), **material)
        case "grid":
            return {**_grid(chosen), "smooth": chosen.random() < 0.5, "translate": center, **material}
        case _:
            turn = {"axis": _direction(chosen), "degrees": chosen.uniform(-400, 400)}
            return {"type": "mesh", "asset": "mesh.obj", "scale": [0.1, 0.5, 2], "rotate": turn, **material}


def _edges(chosen: Random) -> tuple[list[float], list[float]]:
    """Two edges that span an area, of lengths that may differ much."""
    first, second = _direction(chosen), _direction(chosen, chosen.choice([1e-3, 0.5, 2.0]))
    if first[0] * second[0] > 0 and first[1] * second[1] > 0:
        second[0] = -second[0]
    return first, second


def _grid(chosen: Random) -> Json:
    """A flat or wavy mesh of 2 n^2 triangles: tested one by one up to 32, through a tree beyond."""
    n, height = chosen.choice([1, 4, 5]), chosen.choice([0.0, 0.2])
    steps = [-0.5 + i / n for i in range(n + 1)]
    vertices = [[x, height * chosen.random(), z] for x in steps for z in steps]
    cells = [i * (n + 1) + j for i in range(n) for j in range(n)]
    triangles = [face for c in cells for face in ([c, c + n + 2, c + 1], [c, c + n + 1, c + n + 2])]
    uvs: Json = {"uvs": [[3 * x, z] for x in steps for z in steps]} if chosen.random() < 0.5 else {}
    return mesh(vertices, triangles, **uvs)


def _light(chosen: Random) -> Json:
    color = [x * chosen.choice([1, 1, 1, 1e3]) for x in _color(chosen)]
    falloff = {"falloff": chosen.choice(["none", "none", "physical"])}
    match chosen.choice(["lamp", "lamp", "bulb", "spot", "sun"]):
        case "lamp":
            more: Json = {name: chosen.random() < 0.5 for name in ("two_sided", "visible")}
            return lamp(_vector(chosen, 3), *_edges(chosen), color=color, **more, **falloff)
        case "bulb":
            return bulb(_vector(chosen, 3), color) | falloff
        case "spot":
            outer = chosen.choice([1e-3, 20.0, 90.0])
            angles = {"outer_angle": outer, "inner_angle": outer * chosen.choice([0, 0.5, 1 - 1e-15])}
            return spot(_vector(chosen, 3), _direction(chosen), color, **angles) | falloff
        case _:
            return sun(_direction(chosen), color)


def plan_of(seed: int, mode: str, *, culling: bool = True) -> renderer.RenderPlan:
    chosen = Random(f"{mode} {seed}")
    layers = [name for name in LAYER_NAMES if chosen.random() < 0.3]
    quality: Json = {"mode": mode, "precision": chosen.choice(["single", "single", "double"])}
    if mode == "target":
        quality["error"] = chosen.choice([0.5, 0.1, 0.03, 0.01])
        quality["confidence"] = chosen.choice([0.5, 0.95, 0.999])
    given: Any = TypeAdapter(Quality).validate_python(quality)
    loaded = renderer.load_scene(rare_scene(seed), assets=Files(FILES))
    return renderer.compile_scene(loaded, given, layers=layers, culling=culling)


def check(seed: int, mode: str) -> None:
    """Finite, and every fifth the same in other tiles and without culling."""
    plan = plan_of(seed, mode)
    result = renderer.render(plan)
    assert np.isfinite(result.image).all()
    assert result.image.min() >= 0
    assert result.report["numerics"]["non_finite"] == 0
    hit = np.isfinite(result.layers["depth"]) if "depth" in result.layers else None
    for name, layer in result.layers.items():
        assert hit is None or name == "error" or np.isfinite(layer[hit]).all(), name
    if seed % 5 == 0:
        tiled = renderer.render(plan, tile_size=5)
        assert all(same(tiled.layers[name], layer) for name, layer in result.layers.items())
        for other in (tiled, renderer.render(plan_of(seed, mode, culling=False))):
            assert same(other.image, result.image)


@pytest.mark.parametrize("seed", few_of(100, 30))
def test_rare_scenes_are_finite(seed: int) -> None:
    check(seed, "fixed")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(100), 271])
def test_rare_scenes_of_a_target_are_finite(seed: int) -> None:
    check(seed, "target")


def test_tiny_picture_of_an_unreachable_error() -> None:
    """It ends all the same, with at least a thousand samples a pixel."""
    target = TargetQuality(mode="target", error=1e-6)
    shapes = sphere([0, 1, 0], 1), rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])
    document = scene(*shapes, lights=[bulb([1, 3, 2])], camera=camera(width=2, height=1))
    report = renderer.render(renderer.compile_scene(document, target)).report
    assert report["error"]["estimate"] > target.error
    assert report["samples"]["antialiasing_mean"] >= 1000
