"""Seeded tiny scenes of rare combinations: everything that the scene language knows, side by side.

Sizes, places and strengths differ by powers of ten, shapes lie in one plane or in each other, and lights are
far brighter than a picture needs: what people write by accident.
"""

import random
from typing import Any

import numpy as np

from schemas.api.layers import LAYER_NAMES
from tests.documents import Json, bulb, ellipsoid, lamp, phong, rectangle, sphere, sun, triangle
from tests.pictures import pictures
from tests.pictures.parts import png

Random = random.Random

MESH = b"v -1 0 0\nv 1 0.2 0\nv 0 1 0.5\nv 0 0.3 -1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 4/2 2/3\n"
FILES = {
    "picture.png": png(pictures.codes(6, 5)),
    "pixel.png": png(pictures.codes(1, 1)),
    "bumps.png": png(pictures.bumps()),
    "heights.png": png(pictures.codes(3, 4)),
    "mesh.obj": MESH,
}


def rare_scene(seed: int) -> Json:
    """A scene that the language accepts."""
    chosen = Random(seed)
    textures = {name: _texture(chosen, kind) for name, kind in (("a", "any"), ("n", "image"), ("h", "image"))}
    materials = {name: _material(chosen) for name in ("m0", "m1", "m2", "m3")}
    reach = chosen.choice([1.5, 1.5, 1.5, 0.2, 8])
    shapes = [_shape(chosen, reach) for _ in range(chosen.randrange(1, 6))]
    if chosen.random() < 0.7:
        shapes.append(_floor(chosen))
    if chosen.random() < 0.15:
        shapes.append(dict(chosen.choice(shapes), material="m1"))
    return {
        "version": 1,
        "camera": _camera(chosen),
        "background": _color(chosen),
        "ambient": _color(chosen),
        "textures": textures,
        "materials": materials,
        "shapes": shapes,
        "lights": [_light(chosen) for _ in range(chosen.choice([0, 1, 1, 1, 2, 3]))],
        "sampling": _sampling(chosen),
    }


def rare_request(seed: int, mode: str) -> Json:
    """Quality and layers that a scene of this number is rendered with."""
    chosen = Random(f"{mode} {seed}")
    layers = [name for name in LAYER_NAMES if chosen.random() < 0.3]
    precision = chosen.choice(["single", "single", "double"])
    quality: Json = {"mode": mode, "precision": precision}
    if mode == "target":
        quality["error"] = chosen.choice([0.5, 0.1, 0.03, 0.01])
        quality["confidence"] = chosen.choice([0.5, 0.95, 0.999])
    return {"quality": quality, "layers": layers}


def _vector(chosen: Random, reach: float = 1.0) -> list[float]:
    return [chosen.choice([0.0, 0.5, chosen.uniform(-1, 1), chosen.uniform(-1, 1)]) * reach for _ in range(3)]


def _direction(chosen: Random) -> list[float]:
    return [chosen.choice([-1.0, 1.0]) * chosen.uniform(0.1, 1) for _ in range(3)]


def _color(chosen: Random) -> list[float]:
    strength = chosen.choice([0.0, 0.3, 1.0, 1.0, 50.0])
    return [strength * chosen.choice([0.0, 1.0, chosen.random()]) for _ in range(3)]


def _camera(chosen: Random) -> Json:
    camera: Json = {
        "position": [chosen.uniform(-1, 1), chosen.uniform(0.1, 3), chosen.choice([0.5, 3.0, 6.0])],
        "look_at": [0.1, chosen.uniform(-0.2, 0.6), 0.0],
        "vertical_fov": chosen.choice([5, 40, 60, 120, 170]),
        "width": chosen.choice([1, 2, 7, 12, 16]),
        "height": chosen.choice([1, 3, 5, 9, 12]),
    }
    if chosen.random() < 0.2:
        camera["lens_radius"] = chosen.choice([1e-3, 0.1, 1.0])
        if chosen.random() < 0.5:
            camera["focus_distance"] = chosen.choice([0.3, 2.0, 100.0])
    return camera


def _texture(chosen: Random, kind: str) -> Json:
    if kind == "any" and chosen.random() < 0.5:
        repeat = [chosen.choice([0.5, 1.0, 7.3, 400.0]) for _ in range(2)]
        return {"type": "checker", "repeat": repeat, "filter": chosen.choice(["none", "box"])}
    return {
        "type": "image",
        "asset": chosen.choice(["picture.png", "pixel.png", "bumps.png", "heights.png"]),
        "encoding": chosen.choice(["srgb", "linear"]),
        "filter": chosen.choice(["nearest", "bilinear", "mipmap"]),
        "wrap": chosen.choice(["clamp", "repeat", "mirror"]),
    }


def _material(chosen: Random) -> Json:
    parts: Json = {
        "ambient": chosen.choice([0, 0.1, 1]),
        "diffuse": chosen.choice([0, 0.8, 1]),
        "specular": chosen.choice([0, 0, 0.5, 20]),
        "shininess": chosen.choice([0, 1, 20, 1e4, 1e7]),
    }
    if chosen.random() < 0.3:
        parts["color_texture"] = "a"
    if chosen.random() < 0.2:
        parts["normal_map"] = "n"
    if chosen.random() < 0.15:
        parts |= {"bump_map": "h", "bump_height": chosen.choice([0, 0.05, -1.0, 30.0])}
    if chosen.random() < 0.15:
        parts |= {"displacement_map": "h", "displacement_height": chosen.choice([0, 1e-3, 0.2, -0.5])}
    mirror = chosen.choice([0, 0, 0, 0.1, 0.5, 1])
    parts |= {"mirror": mirror, "max_depth": chosen.choice([1, 2, 5])}
    if chosen.random() < 0.25:
        parts |= {"transmission": 1 - mirror, "ior": chosen.choice([1, 1.5, 0.7, 1.0000001, 50])}
    return phong([chosen.random() for _ in range(3)], **parts)


def _shape(chosen: Random, reach: float) -> Json:
    material = chosen.choice(["m0", "m1", "m2", "m3"])
    center = _vector(chosen, reach)
    match chosen.choice(["triangle", "smooth", "rectangle", "sphere", "ellipsoid", "mesh", "grid", "file"]):
        case "triangle":
            return triangle(*(_vector(chosen, reach) for _ in range(3)), material=material)
        case "smooth":
            normals = [_direction(chosen) for _ in range(3)]
            uvs = [[chosen.uniform(-2, 2), chosen.choice([0.0, 1.0])] for _ in range(3)]
            corners = (_vector(chosen, reach) for _ in range(3))
            return triangle(*corners, material=material, normals=normals, uvs=uvs)
        case "rectangle":
            return rectangle(center, *_edges(chosen), material=material)
        case "sphere":
            return sphere(center, chosen.choice([1e-6, 0.1, 0.5, 2.0]), material=material)
        case "ellipsoid":
            return ellipsoid(center, *_axes(chosen), material=material)
        case "mesh":
            return {**_tent(), "smooth": chosen.random() < 0.5, "translate": center, "material": material}
        case "grid":
            return {
                **_grid(chosen),
                "smooth": chosen.random() < 0.5,
                "translate": center,
                "material": material,
            }
        case _:
            turn = {"axis": _direction(chosen), "degrees": chosen.uniform(-400, 400)}
            scale = chosen.choice([0.1, [1, 0.5, 2]])
            return {"type": "mesh", "asset": "mesh.obj", "scale": scale, "rotate": turn, "material": material}


def _edges(chosen: Random) -> tuple[list[float], list[float]]:
    """Two edges that span an area, of lengths that may differ much."""
    first, second = _direction(chosen), _direction(chosen)
    second[0] = -second[0] if first[0] * second[0] > 0 and first[1] * second[1] > 0 else second[0]
    length = chosen.choice([1e-3, 0.5, 2.0])
    return first, [length * x for x in second]


def _axes(chosen: Random) -> list[list[float]]:
    turned, _ = np.linalg.qr(np.array([_direction(chosen) for _ in range(3)]))
    lengths = [chosen.choice([1e-3, 0.3, 1.0]) for _ in range(3)]
    return [[float(x) * length for x in axis] for axis, length in zip(turned, lengths, strict=True)]


def _tent() -> Json:
    vertices = [[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5], [0, 0.7, 0]]
    return {"type": "mesh", "vertices": vertices, "triangles": [[4, 1, 0], [4, 2, 1], [4, 3, 2], [4, 0, 3]]}


def _grid(chosen: Random) -> Json:
    """A flat or wavy mesh of 2 n^2 triangles: tested one by one up to 32, through a tree beyond."""
    n, height = chosen.choice([1, 4, 5]), chosen.choice([0.0, 0.2])
    steps = [-0.5 + i / n for i in range(n + 1)]
    vertices = [[x, height * chosen.random(), z] for x in steps for z in steps]
    cells = [i * (n + 1) + j for i in range(n) for j in range(n)]
    lower = [[c, c + n + 2, c + 1] for c in cells]
    upper = [[c, c + n + 1, c + n + 2] for c in cells]
    uvs = [[3 * x, z] for x in steps for z in steps] if chosen.random() < 0.5 else None
    return {"type": "mesh", "vertices": vertices, "triangles": lower + upper} | ({"uvs": uvs} if uvs else {})


def _floor(chosen: Random) -> Json:
    size = chosen.choice([2.0, 50.0, 1e6])
    material = chosen.choice(["m0", "m1"])
    normal, tangent = [0, 1, 0], [1, 0, 0]
    center = [0, chosen.choice([0.0, -0.5]), 0]
    sides = [size, size]
    return {
        "type": "rectangle",
        "center": center,
        "normal": normal,
        "tangent": tangent,
        "size": sides,
        "material": material,
    }


def _light(chosen: Random) -> Json:
    color = [x * chosen.choice([1, 1, 1, 1e3]) for x in _color(chosen)]
    falloff = {"falloff": chosen.choice(["none", "none", "physical"])}
    match chosen.choice(["lamp", "lamp", "bulb", "sun"]):
        case "lamp":
            corner, edges = _vector(chosen, 3), _edges(chosen)
            more: dict[str, Any] = {name: chosen.random() < 0.5 for name in ("two_sided", "visible")}
            return lamp(corner, *edges, color=color, **more, **falloff)
        case "bulb":
            return bulb(_vector(chosen, 3), color) | falloff
        case _:
            return sun(_direction(chosen), color)


def _sampling(chosen: Random) -> Json:
    pattern = chosen.choice(["center", "uniform", "rotated", "random", "stratified", "sobol"])
    light = chosen.choice(["uniform", "random", "stratified", "sobol"])
    samples = 1 if pattern == "center" else chosen.choice([1, 4, 9])
    return {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": light, "samples": chosen.choice([1, 4, 9])},
        "seed": chosen.choice([0, 1, 2**53 - 1]),
    }
