"""Random scenes of the kinds that people build: rooms, tables, lamps at walls, boards, meshes, mirrors.

Numbers are drawn, never picked, so that no one knows beforehand what a renderer finds hard about them.
"""

from __future__ import annotations

import io
import math
from functools import cache
from random import Random
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from PIL import Image

from benchmarks.everyday_shapes import block, bulb, fence, panel, plants, sheet, sun, things
from benchmarks.report import uniform
from scenes.make_meshes import ply, shell

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchmarks.report import Json

SIZES = ((64, 64), (80, 60), (96, 64), (72, 96), (96, 96))
"""Width and height of the pictures, pixels: small, so that references are affordable."""


class EverydayFiles(dict[str, bytes]):
    """The textures and the mesh of the scenes, as an asset source."""

    def read(self, name: str) -> bytes:
        """Content of a file."""
        return self[name]


@cache
def files() -> EverydayFiles:
    """The files that the scenes name."""
    heights = _waves(48, 9) / 2 + _waves(48, 4) / 2
    slope_y, slope_x = np.gradient(heights * 6)
    normals = np.stack((-slope_x, slope_y, np.ones_like(heights)))
    normals /= np.linalg.norm(normals, axis=0)
    rows, columns = np.indices((64, 64))
    tiles = np.where((rows // 16 + columns // 16) % 2, 0.75, 0.3) * (0.7 + 0.3 * _waves(64, 11))
    tiles[(rows % 16 == 0) | (columns % 16 == 0)] = 0.1
    return EverydayFiles(
        {
            "tiles.png": _png(np.stack((tiles, tiles * 0.9, tiles * 0.7))),
            "marble.png": _png(np.stack([0.4 + 0.6 * _waves(96, n) for n in (5, 6, 7)])),
            "relief.png": _png(normals / 2 + 0.5),
            "heights.png": _png(np.stack([heights] * 3)),
            "shell.ply": ply(*shell(60, 16)),
        }
    )


def _waves(side: int, seed: int) -> NDArray[np.float64]:
    """A smooth field (side, side) that repeats, 0 to 1."""
    drawn = np.random.default_rng(seed)
    y, x = np.indices((side, side)) * (2 * np.pi / side)
    field = np.zeros((side, side))
    for _ in range(6):
        across, along = drawn.integers(-5, 6, 2)
        field += np.cos(across * x + along * y + drawn.uniform(0, 2 * np.pi))
    scaled: NDArray[np.float64] = (field - field.min()) / np.ptp(field)
    return scaled


def _png(channels: NDArray[np.float64]) -> bytes:
    buffer = io.BytesIO()
    codes = np.rint(255 * np.clip(channels, 0, 1)).astype(np.uint8)
    Image.fromarray(np.ascontiguousarray(codes.transpose(1, 2, 0))).save(buffer, format="PNG")
    return buffer.getvalue()


def _color(drawn: Random, low: float = 0.1, high: float = 0.95) -> list[float]:
    return [round(drawn.uniform(low, high), 3) for _ in range(3)]


def _spread(drawn: Random, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(f"{math.exp(drawn.uniform(math.log(low), math.log(high))):.3g}")


def _textures(drawn: Random) -> Json:
    def image(name: str, encoding: str) -> Json:
        filtered = drawn.choice(["nearest", "bilinear", "bilinear", "mipmap"])
        return {"type": "image", "asset": name, "encoding": encoding, "filter": filtered, "wrap": "repeat"}

    squares = float(drawn.choice([4, 8, 12, 20, 32, 64]))
    board = {"type": "checker", "even": _color(drawn, 0.6, 0.95), "odd": _color(drawn, 0.02, 0.3)}
    return {
        "board": board | {"repeat": [squares, squares], "filter": drawn.choice(["none", "none", "box"])},
        "picture": image(drawn.choice(["tiles.png", "marble.png"]), "srgb"),
        "relief": image("relief.png", "linear") | {"filter": "bilinear"},
        "heights": image("heights.png", "linear") | {"filter": "bilinear"},
    }


def _materials(drawn: Random) -> Json:
    """A material for each part that a scene may have, the plainest most often."""

    def matte(**more: Any) -> Json:
        color, ambient = _color(drawn), drawn.choice([0.05, 0.1, 0.3])
        base: Json = {} if "color_texture" in more else {"color": color}
        return {"type": "phong", **base, "ambient": ambient, "diffuse": drawn.uniform(0.6, 1), **more}

    def gloss(**more: Any) -> Json:
        return matte(specular=drawn.uniform(0.1, 0.8), shininess=_spread(drawn, 5, 800), **more)

    def mirror() -> Json:
        return gloss(mirror=drawn.uniform(0.1, 0.95), max_depth=drawn.choice([1, 2, 4, 8]))

    def glass() -> Json:
        through, ior = drawn.uniform(0.5, 0.95), drawn.choice([1.33, 1.5, 1.8])
        return gloss(transmission=through, ior=ior, max_depth=drawn.choice([2, 4, 6]))

    def carved() -> Json:
        if drawn.random() < 0.5:
            return gloss(normal_map="relief")
        return gloss(bump_map="heights", bump_height=_spread(drawn, 0.005, 0.05))

    def painted() -> Json:
        return gloss(color_texture="picture") | ({"normal_map": "relief"} if drawn.random() < 0.3 else {})

    def any_of() -> Json:
        return drawn.choices([matte, gloss, mirror, glass, carved, painted], [5, 4, 1.2, 0.8, 0.5, 0.7])[0]()

    ground = drawn.choices([matte, gloss, painted, mirror], [5, 2, 1, 0.5])[0]()
    return {
        "ground": ground,
        "wall": drawn.choices([matte, gloss, painted], [5, 1, 0.5])[0](),
        "board": gloss(color_texture="board"),
        "painted": painted(),
        "carved": carved(),
        "matte": matte(),
    } | {f"thing{n}": any_of() for n in range(4)}


def _lamp(drawn: Random, center: list[float], normal: list[float], side: float, away: float) -> Json:
    """A rectangle light that lights well what is `away`; with physical falloff it burns out what is near."""
    sides = [side, side * drawn.choice([1.0, 1.0, 0.5, 0.1])]
    physical = drawn.random() < 0.4
    strength = math.pi * away**2 / (sides[0] * sides[1]) if physical else 1.0
    tangent = [normal[1], normal[2], normal[0]]
    return {
        "type": "rectangle",
        "center": center,
        "normal": normal,
        "tangent": tangent,
        "size": sides,
        "color": [round(strength * drawn.uniform(0.5, 0.9), 4) for _ in range(3)],
        "visible": drawn.random() < 0.5,
        "two_sided": drawn.random() < 0.5,
        "falloff": "physical" if physical else "none",
    }


def _more_lights(drawn: Random, high: float) -> list[Json]:
    """Nothing as a rule, else a bulb or the sun."""
    kind = drawn.choice(["none", "none", "none", "bulb", "sun", "both"])
    if kind == "bulb":
        place = [drawn.uniform(-high, high), high, drawn.uniform(0, high)]
        return [bulb(place, _color(drawn, 0.05, 0.4))]
    if kind == "sun":
        return [sun([drawn.uniform(-1, 1), -1, drawn.uniform(-1, 0.5)], _color(drawn, 0.05, 0.4))]
    if kind == "both":
        colors = _color(drawn, 0.05, 0.3), _color(drawn, 0.05, 0.3)
        return [sun([0.3, -1, -0.4], colors[0]), bulb([0, high, high], colors[1])]
    return []


Parts: TypeAlias = "tuple[list[Json], list[Json], Json]"
"""Shapes, lights and camera of a scene."""


def _camera(drawn: Random, eye: list[float], at: list[float], fov: tuple[float, float] = (30, 60)) -> Json:
    jitter = [place + drawn.uniform(-0.1, 0.1) * math.dist(eye, at) for place in eye]
    return {
        "position": jitter,
        "look_at": at,
        "vertical_fov": drawn.uniform(*fov),
        "focus_distance": math.dist(jitter, at) * drawn.uniform(0.7, 1.3),
    }


def _room(drawn: Random) -> Parts:
    wide, high, deep = drawn.uniform(3, 7), drawn.uniform(2.4, 3.5), drawn.uniform(3, 7)
    shapes = [
        sheet([-wide / 2, 0, -deep / 2], [0, 0, deep], [wide, 0, 0], drawn.choice(["ground", "board"])),
        sheet([-wide / 2, high, -deep / 2], [wide, 0, 0], [0, 0, deep], "wall"),
        sheet([-wide / 2, 0, -deep / 2], [wide, 0, 0], [0, high, 0], "wall"),
        sheet([-wide / 2, 0, -deep / 2], [0, high, 0], [0, 0, deep], drawn.choice(["wall", "painted"])),
        sheet([wide / 2, 0, -deep / 2], [0, 0, deep], [0, high, 0], "wall"),
        *things(drawn, drawn.randrange(2, 6), wide / 3, 0.15 * high),
    ]
    side = _spread(drawn, 0.3, 1.5)
    if drawn.random() < 0.7:
        below = _spread(drawn, 0.02, 0.6)
        place = [drawn.uniform(-0.3, 0.3) * wide, high - below, drawn.uniform(-0.3, 0.3) * deep]
        lamp = _lamp(drawn, place, [0, -1, 0], side, high / 2)
    else:
        place = [-wide / 2 + _spread(drawn, 0.02, 0.5), high / 2, drawn.uniform(-0.3, 0.2) * deep]
        lamp = _lamp(drawn, place, [1, 0, 0], side, wide / 2)
    eye = [drawn.uniform(-0.3, 0.3) * wide, 0.5 * high, 0.45 * deep + drawn.choice([0.0, 3.0])]
    lights = [lamp, *_more_lights(drawn, 0.9 * high)]
    return shapes, lights, _camera(drawn, eye, [0, 0.35 * high, 0], (40, 75))


def _table(drawn: Random) -> Parts:
    top = sheet([-2, 0, -2], [0, 0, 4], [4, 0, 0], drawn.choice(["ground", "ground", "painted", "board"]))
    shapes = [top, *things(drawn, drawn.randrange(3, 9), 1.5, 0.35)]
    if drawn.random() < 0.4:
        shapes.append(sheet([-6, -1.5, -6], [0, 0, 12], [12, 0, 0], "ground"))
    lights = []
    for _ in range(drawn.choice([1, 1, 2, 3])):
        high = drawn.uniform(1.2, 4)
        place = [drawn.uniform(-2, 2), high, drawn.uniform(-2, 2)]
        lights.append(_lamp(drawn, place, [-place[0], -high, -place[2]], _spread(drawn, 0.2, 2), high))
    eye = [drawn.uniform(-2, 2), drawn.uniform(1, 4), drawn.uniform(3, 6)]
    return shapes, [*lights, *_more_lights(drawn, 3)], _camera(drawn, eye, [0, 0.2, 0], (25, 50))


def _wall(drawn: Random) -> Parts:
    """A lamp that hangs close to a wall, or that leans on it."""
    back = sheet([-4, 0, 0], [8, 0, 0], [0, 5, 0], "wall")
    floor = sheet([-4, 0, 0], [0, 0, 6], [8, 0, 0], "ground")
    shapes = [back, floor, *things(drawn, drawn.randrange(0, 4), 1.5, 0.4, front=1.0)]
    away, side = _spread(drawn, 0.03, 0.8), _spread(drawn, 0.3, 2.0)
    place = [drawn.uniform(-1, 1), drawn.uniform(1, 3), away]
    normal = drawn.choice([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.0, -1.0, -1.0]])
    if normal[1]:
        place[2] += side / 2
    lamp = _lamp(drawn, place, normal, side, drawn.choice([away, 1.0])) | {"visible": drawn.random() < 0.3}
    eye = [drawn.uniform(-2, 2), drawn.uniform(1, 3), drawn.uniform(4, 8)]
    return shapes, [lamp, *_more_lights(drawn, 4)], _camera(drawn, eye, [0, 1.5, 0], (30, 55))


def _field(drawn: Random) -> Parts:
    """A large scene with things far thinner than pixels."""
    size = _spread(drawn, 20, 300)
    ground = sheet([-size, 0, -size], [0, 0, 2 * size], [2 * size, 0, 0], drawn.choice(["ground", "board"]))
    shapes = [ground]
    for _ in range(drawn.randrange(1, 4)):
        build = drawn.choice([fence, plants, block])
        shapes += build(drawn, size)
    high = size * drawn.uniform(0.3, 0.8)
    place = [drawn.uniform(-0.5, 0.5) * size, high, drawn.uniform(-0.3, 0.5) * size]
    lights = [_lamp(drawn, place, [-place[0], -high, -place[2]], _spread(drawn, 0.03, 0.5) * size, high)]
    if drawn.random() < 0.3:
        lights = [sun([drawn.uniform(-1, 1), -1, drawn.uniform(-1, 1)], _color(drawn, 0.5, 0.9))]
    eye = [drawn.uniform(-0.3, 0.3) * size, drawn.uniform(0.03, 0.3) * size, 0.8 * size]
    return shapes, lights, _camera(drawn, eye, [0, 0.05 * size, 0], (20, 50))


def _board(drawn: Random) -> Parts:
    size = _spread(drawn, 2, 20)
    ground = sheet([-size, 0, -size], [0, 0, 2 * size], [2 * size, 0, 0], "board")
    shapes = [ground, *things(drawn, drawn.randrange(1, 6), 1.5, 0.5)]
    high = drawn.uniform(2, 5)
    lamp = _lamp(drawn, [drawn.uniform(-2, 2), high, 1], [0, -1, 0], _spread(drawn, 0.2, 2), high)
    eye = [drawn.uniform(-2, 2), drawn.uniform(0.4, 3), drawn.uniform(4, 7)]
    return shapes, [lamp, *_more_lights(drawn, 4)], _camera(drawn, eye, [0, 0.4, 0])


def _mesh(drawn: Random) -> Parts:
    ground = sheet([-3, 0, -3], [0, 0, 6], [6, 0, 0], drawn.choice(["ground", "board"]))
    model: Json = {"type": "mesh", "asset": "shell.ply", "material": drawn.choice(["thing0", "matte"])}
    turn = {"axis": [0, 1, 0], "degrees": drawn.uniform(0, 360)}
    model |= {"scale": drawn.uniform(0.3, 0.7), "rotate": turn, "smooth": drawn.random() < 0.5}
    shapes = [ground, model, *things(drawn, drawn.randrange(0, 3), 1.8, 0.3)]
    high = drawn.uniform(1.5, 4)
    place = [drawn.uniform(-2, 2), high, drawn.uniform(-1, 2)]
    lamp = _lamp(drawn, place, [-place[0], -high, -place[2]], _spread(drawn, 0.2, 1.5), high)
    eye = [drawn.uniform(-2, 2), drawn.uniform(1, 3), drawn.uniform(3, 6)]
    return shapes, [lamp, *_more_lights(drawn, 4)], _camera(drawn, eye, [0, 0.6, 0], (25, 45))


def _wares(drawn: Random) -> Parts:
    """Panels with pictures and reliefs on a wall."""
    shapes = [
        sheet([-5, 0, -0.5], [10, 0, 0], [0, 5, 0], "wall"),
        sheet([-5, 0, -0.5], [0, 0, 6], [10, 0, 0], "ground"),
    ]
    names = ["painted", "carved", "board", "thing0"]
    shapes += [panel(drawn, x, drawn.choice(names)) for x in (-1.3, 0.0, 1.3)[: drawn.randrange(1, 4)]]
    shapes += things(drawn, drawn.randrange(0, 4), 1.2, 0.3, front=1.2)
    place = [drawn.uniform(-3, 3), drawn.uniform(2, 4), drawn.uniform(0.5, 3)]
    normal = [-place[0], 1.2 - place[1], -place[2]]
    lamp = _lamp(drawn, place, normal, _spread(drawn, 0.2, 1.5), 2.5)
    eye = [drawn.uniform(-1.5, 1.5), drawn.uniform(0.8, 2.5), drawn.uniform(3.5, 6)]
    return shapes, [lamp, *_more_lights(drawn, 4)], _camera(drawn, eye, [0, 1.0, 0], (30, 50))


KINDS = {
    "room": _room, "table": _table, "wall": _wall, "field": _field, "board": _board, "mesh": _mesh,
    "wares": _wares,
}  # fmt: skip


def everyday_scene(number: int) -> Json:
    """Scene of a number: any whole number gives one that the language accepts."""
    drawn = Random(f"everyday {number}")  # noqa: S311  (the same scene each time)
    kind = drawn.choice([*KINDS])
    shapes, lights, camera = KINDS[kind](drawn)
    width, height = drawn.choice(SIZES)
    lens = {} if drawn.random() < 0.85 else {"lens_radius": drawn.choice([0.02, 0.05, 0.1])}
    return {
        "version": 1,
        "name": f"{kind}-{number}",
        "camera": {"width": width, "height": height} | camera | lens,
        "background": _color(drawn, 0.0, 0.7),
        "ambient": [drawn.choice([0.0, 0.5, 1.0])] * 3,
        "textures": _textures(drawn),
        "materials": _materials(drawn),
        "shapes": shapes,
        "lights": lights,
        "sampling": uniform(1, 1) | {"seed": drawn.randrange(1000, 2**40)},
    }
