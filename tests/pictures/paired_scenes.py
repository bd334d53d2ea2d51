"""Random scenes in which a shape of every kind is in the way of every kind, itself included.

A scene draws kinds before numbers: what is looked at, what stands between that and the light, which light,
how many light points, and which of the ways that the renderer knows for few shapes, or for many, each of them
takes. The last needs no other picture: a flat mesh looks the same with its triangles cut into smaller ones,
and triangles far from all rays make a family large that has few near ones.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

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
from tests.solids import outward

Random = random.Random
Floats = np.ndarray

FILES = {"white.png": np.full((1, 1, 3), 255, np.uint8), "black.png": np.zeros((1, 1, 3), np.uint8)}
"""Maps of heights that move a shape as a whole, or leave it where it is."""

MAPS = {"raised": "white", "displaced": "black"}
RAISED = 0.15
"""Height of white, scene units."""

MATTERS = ["plain", "plain", "glossy", "mirror", "glass"]
QUIET = ["plain", "plain", "glossy"]
"""Materials of scenes whose light points are drawn for the camera's rays alone."""


@dataclass(frozen=True)
class Place:
    """Placement of a shape: centre, size, and three unit vectors, the last towards its front."""

    center: Floats
    size: float
    axes: Floats

    def at(self, *places: Any) -> list[list[float]]:
        """Places (n, 3) along the axes, in shares of the size."""
        return (self.center + self.size * np.array(places, dtype=float) @ self.axes).tolist()

    def along(self, *shares: float) -> list[float]:
        return (self.size * np.array(shares) @ self.axes).tolist()


def _triangle(chosen: Random, place: Place) -> Json:
    turned = [chosen.uniform(0, 0.5) + 2.1 * i for i in range(3)]
    corners = [[np.cos(a), np.sin(a), chosen.uniform(-0.3, 0.3)] for a in turned]
    return triangle(*place.at(*chosen.choice([corners, corners[::-1]])))


def _smooth_triangle(chosen: Random, place: Place) -> Json:
    normals = [place.along(*_within(chosen, 0.4), 1) for _ in range(3)]
    return {**_triangle(chosen, place), "normals": normals}


def _rectangle(chosen: Random, place: Place) -> Json:
    (corner,) = place.at([-0.9, -0.8, chosen.uniform(-0.2, 0.2)])
    return rectangle(corner, place.along(1.6, 0.3, 0.1), place.along(*_within(chosen, 0.4)[:1], 1.5, 0))


def _centred_rectangle(chosen: Random, place: Place) -> Json:
    sizes = [place.size * chosen.uniform(1, 2) for _ in range(2)]
    parts = {"center": place.center, "normal": 3 * place.axes[2], "tangent": place.axes[0] + place.axes[2]}
    written: Json = {name: part.tolist() for name, part in parts.items()}
    return {"type": "rectangle", **written, "size": sizes}


def _sphere(chosen: Random, place: Place) -> Json:
    return sphere(place.center, place.size * chosen.uniform(0.4, 0.9))


def _ellipsoid(chosen: Random, place: Place) -> Json:
    return ellipsoid(
        place.center, *(axis * place.size * chosen.uniform(0.25, 1.1) for axis in _turned(chosen, place.axes))
    )


def _fold(chosen: Random, place: Place, **more: Any) -> Json:
    """A book, whose leaves share an edge, or a wall on a floor, which does not."""
    height, lean = chosen.uniform(0.5, 1.2), chosen.uniform(-0.6, 0.6)
    floor, ends = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [(-1, 0), (1, 0)]
    if chosen.random() < 0.5:
        top = [[x, lean - 0.5, height] for x, _ in ends]
        return _placed(chosen, place, [*floor, *top], [[0, 1, 2], [0, 2, 3], [1, 0, 4], [1, 4, 5]], **more)
    y = chosen.uniform(-0.4, 0.6)
    wall = [[x, y + shift, z] for z, shift in ((0.01, 0), (height, lean)) for x, _ in ends]
    return _placed(chosen, place, [*floor, *wall], [[0, 1, 2], [0, 2, 3], [4, 5, 7], [4, 7, 6]], **more)


def _smooth_fold(chosen: Random, place: Place) -> Json:
    return _fold(chosen, place, smooth=True)


def _solid(chosen: Random, place: Place, **more: Any) -> Json:
    """A closed mesh of 20 triangles, longer along one axis than along others."""
    vertices, triangles = outward([0.0, 0.0, 0.0], 0.9, 0)
    longer = [chosen.uniform(0.4, 1.1) for _ in range(3)]
    return _placed(chosen, place, (vertices * longer).tolist(), triangles.tolist(), **more)


def _smooth_solid(chosen: Random, place: Place) -> Json:
    return _solid(chosen, place, smooth=True)


def _placed(chosen: Random, place: Place, vertices: Any, triangles: Any, **more: Any) -> Json:
    """A mesh with its vertices where they are, or scaled, turned and moved there."""
    if chosen.random() < 0.5:
        return mesh(place.at(*vertices), triangles, **more)
    cosine = (np.trace(place.axes) - 1) / 2
    skew = place.axes.T - place.axes
    turn = {"axis": [skew[2, 1], skew[0, 2], skew[1, 0]], "degrees": float(np.degrees(np.arccos(cosine)))}
    where = {"scale": place.size, "rotate": turn, "translate": place.center.tolist()}
    return mesh(vertices, triangles, **where, **more)


Make = Callable[[Random, Place], Json]

KINDS: dict[str, Make] = {
    "triangle": _triangle,
    "smooth triangle": _smooth_triangle,
    "rectangle": _rectangle,
    "rectangle by its centre": _centred_rectangle,
    "sphere": _sphere,
    "ellipsoid": _ellipsoid,
    "fold": _fold,
    "smooth fold": _smooth_fold,
    "solid": _solid,
    "smooth solid": _smooth_solid,
    "raised triangle": _triangle,
    "raised rectangle": _rectangle,
    "displaced fold": _fold,
}
PAIRS = [(seen, between) for seen in KINDS for between in KINDS]
HOLLOW = {"sphere", "ellipsoid", "solid", "smooth solid"}
"""Kinds that camera and light may be inside of."""


@dataclass(frozen=True)
class Paired:
    """A scene of few shapes, and one of more with the same picture."""

    plain: Json
    rendered: Json


def paired_scene(seed: int) -> Paired:
    """The kinds of any range of seeds differ: 71 has no divisor in common with their number."""
    chosen = Random(f"pairs {seed}")
    seen, between = PAIRS[seed * 71 % len(PAIRS)]
    pattern = chosen.choice(["uniform", "uniform", "random", "stratified", "sobol"])
    matters = MATTERS if pattern == "uniform" else QUIET
    front = _direction(chosen)
    place = Place(_vector(chosen, 0.5), chosen.uniform(0.8, 1.3), _frame(chosen, front))
    if seen in HOLLOW and chosen.random() < 0.2:
        place = Place(place.center, 7.0, place.axes)
    way, far = _near(chosen, front), chosen.uniform(2.5, 4.5)
    shapes = [_made(chosen, seen, place, matters)]
    if seen != between or chosen.random() < 0.5:
        center = place.center + way * far * chosen.uniform(0.25, 0.6) + _vector(chosen, 0.3)
        nearer = Place(center, chosen.uniform(0.3, 0.8), _frame(chosen, _direction(chosen)))
        shapes.append(_made(chosen, between, nearer, matters))
    for _ in range(chosen.choice([0, 0, 1, 2])):
        other = Place(_vector(chosen, 2), chosen.uniform(0.3, 0.9), _frame(chosen, _direction(chosen)))
        shapes.append(_made(chosen, chosen.choice(list(KINDS)), other, matters))
    chosen.shuffle(shapes)
    lights = [_light(chosen, place.center + way * far, way)]
    if chosen.random() < 0.25:
        lights.append(_light(chosen, _vector(chosen, 4), _direction(chosen)))
    for light in lights:
        if light["type"] != "directional":
            light["falloff"] = chosen.choice(["none", "none", "physical"])
    view = camera(
        position=(place.center + _near(chosen, front) * chosen.uniform(2.5, 5)).tolist(),
        look_at=(place.center + _vector(chosen, 0.2)).tolist(),
        vertical_fov=chosen.uniform(30, 60),
        width=8,
        height=6,
    )
    samples = chosen.choice([1, 1, 1, 4])
    plain = scene(
        *shapes,
        lights=lights,
        camera=view,
        sampling=sampled(samples, chosen.choice([1, 4, 9]), "uniform", pattern, seed),
        textures={
            n: {"type": "image", "asset": f"{n}.png", "encoding": "linear"} for n in ("white", "black")
        },
        materials=_materials(chosen),
    )
    return Paired(plain, _with_more(chosen, plain))


def _made(chosen: Random, kind: str, place: Place, matters: list[str]) -> Json:
    material = chosen.choice(matters)
    how = kind.split(maxsplit=1)[0]
    moved = f"{how} {material}" if how in MAPS else material
    return {**KINDS[kind](chosen, place), "material": moved}


def _materials(chosen: Random) -> Json:
    shininess = chosen.choice([0, 3, 30, 300])
    base = {
        "plain": phong(),
        "glossy": phong([0.3, 0.5, 0.7], specular=0.5, shininess=shininess),
        "mirror": phong(mirror=0.4, max_depth=2),
        "glass": phong([0.2, 0.1, 0.1], transmission=0.8, ior=chosen.choice([0.7, 1.0, 1.5]), max_depth=3),
    }
    moved = {
        f"{how} {name}": {**material, "displacement_map": map_, "displacement_height": RAISED}
        for how, map_ in MAPS.items()
        for name, material in base.items()
    }
    return {**base, **moved}


def _light(chosen: Random, position: Floats, way: Floats) -> Json:
    kind = chosen.choice(["lamp", "skew lamp", "bulb", "spot", "sun"])
    if kind == "bulb":
        return bulb(position)
    if kind == "spot":
        outer = chosen.uniform(10, 90)
        angles = {"outer_angle": outer, "inner_angle": outer * chosen.uniform(0, 0.9)}
        return spot(position, -way * chosen.uniform(0.5, 2) + _vector(chosen, 0.2), **angles)
    if kind == "sun":
        return sun(-way * chosen.uniform(0.5, 2))
    first, second, _ = _frame(chosen, -way) * chosen.choice([0.05, 0.5, 2.0])
    if kind == "skew lamp":
        second = second + chosen.uniform(0.2, 0.8) * first
    more = {name: chosen.random() < 0.5 for name in ("two_sided", "visible")}
    return lamp(position - first / 2 - second / 2, first, second, **more)


def _with_more(chosen: Random, plain: Json) -> Json:
    """The same picture with more triangles: the faces of flat meshes cut, and others far from all rays."""
    parts = chosen.choice([1, 1, 1, 2, 2, 3, 3, 8, 8, 25])
    shapes = [_in_parts(shape, parts) if _may_be_cut(plain, shape) else shape for shape in plain["shapes"]]
    suns = [x["direction"] for x in plain["lights"] if x["type"] == "directional"]
    center = 500 * _unit(np.sum([_unit(np.array(way)) for way in suns] or [_direction(chosen)], axis=0))
    corners = [np.add(center, [0.001 * i, 0.002 * (i % 3), 0.003 * (i % 7)]) for i in range(42)]
    rows = [[i, i + 1, i + 2] for i in range(40)]
    singles = [triangle(*(corners[i] for i in row)) for row in rows]
    return {**plain, "shapes": [*shapes, *chosen.choice([[], [mesh(corners, rows)], singles])]}


def _may_be_cut(plain: Json, shape: Json) -> bool:
    """Not with normals between vertices, and what is displaced is cut anyway."""
    moved = "displacement_map" in plain["materials"][shape["material"]]
    return shape["type"] == "mesh" and not shape.get("smooth") and not moved


def _in_parts(shape: Json, parts: int) -> Json:
    vertices, triangles = cut(shape["vertices"], shape["triangles"], parts)
    return {**shape, "vertices": vertices.tolist(), "triangles": triangles.tolist()}


def cut(vertices: Any, triangles: Any, parts: int) -> tuple[Floats, Floats]:
    """The same surface with every edge of its triangles cut into so many parts."""
    places = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    number = {place: k for k, place in enumerate(places)}
    rows = [[number[i, j], number[i + 1, j], number[i, j + 1]] for i, j in places if i + j < parts]
    rows += [
        [number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]] for i, j in places if i + j < parts - 1
    ]
    shares = np.array([(parts - i - j, i, j) for i, j in places]) / parts
    corners = np.asarray(vertices, dtype=float)[np.asarray(triangles)]
    begins = len(places) * np.arange(len(corners))
    return (shares @ corners).reshape(-1, 3), (np.array(rows) + begins[:, None, None]).reshape(-1, 3)


def _vector(chosen: Random, reach: float) -> Floats:
    return np.array([chosen.uniform(-reach, reach) for _ in range(3)])


def _within(chosen: Random, reach: float) -> list[float]:
    return [chosen.uniform(-reach, reach) for _ in range(2)]


def _direction(chosen: Random) -> Floats:
    return _unit(np.array([chosen.gauss(0, 1) for _ in range(3)]))


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _near(chosen: Random, front: Floats) -> Floats:
    """A direction on the side of another, well above the horizon."""
    way = _unit(front + 0.9 * _direction(chosen))
    return way if way @ front > 0.25 else front


def _frame(chosen: Random, front: Floats) -> Floats:
    """Three perpendicular unit vectors, right-handed, the last of them given."""
    first = _unit(np.cross(front, _direction(chosen)))
    return np.array([first, np.cross(front, first), front])


def _turned(chosen: Random, axes: Floats) -> Floats:
    """The axes, or three others."""
    return axes if chosen.random() < 0.5 else _frame(chosen, _direction(chosen))
