"""Furniture of random scenes: things on a floor, fences and plants in a field, panels on a wall."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from random import Random

    from benchmarks.report import Json

Vector = list[float]


def sheet(corner: Vector, first: Vector, second: Vector, material: str) -> Json:
    """A wall, a floor, a table."""
    return {"type": "rectangle", "corner": corner, "edges": [first, second], "material": material}


def triangle(*vertices: Vector, material: str) -> Json:
    """A triangle by its vertices."""
    return {"type": "triangle", "vertices": list(vertices), "material": material}


def ellipsoid(center: Vector, *axes: Vector, material: str) -> Json:
    """An ellipsoid by its semi-axes."""
    return {"type": "ellipsoid", "center": center, "axes": list(axes), "material": material}


def bulb(position: Vector, color: Vector) -> Json:
    """A point light."""
    return {"type": "point", "position": position, "color": color}


def sun(direction: Vector, color: Vector) -> Json:
    """A directional light."""
    return {"type": "directional", "direction": direction, "color": color}


def things(drawn: Random, count: int, reach: float, size: float, front: float = 0.0) -> list[Json]:
    """Balls, eggs, boxes and slabs that stand on the floor around the origin, or before it."""
    return [shape for _ in range(count) for shape in _thing(drawn, reach, size, front)]


def _thing(drawn: Random, reach: float, size: float, front: float) -> list[Json]:
    x, z = drawn.uniform(-reach, reach), front + drawn.uniform(-reach, reach) * (0.4 if front else 1.0)
    big = size * drawn.uniform(0.4, 1.4)
    material = drawn.choice(["matte", "thing0", "thing1", "thing2", "thing3"])
    match drawn.choice(["ball", "ball", "egg", "box", "slab", "sail"]):
        case "ball":
            return [{"type": "ellipsoid", "center": [x, big, z], "radius": big, "material": material}]
        case "egg":
            turn = drawn.uniform(0, math.pi)
            wide, thin = big, big * drawn.uniform(0.15, 0.8)
            across = [wide * math.cos(turn), 0, wide * math.sin(turn)]
            along = [-thin * math.sin(turn), 0, thin * math.cos(turn)]
            return [ellipsoid([x, big, z], across, [0, big, 0], along, material=material)]
        case "box":
            return box([x, 0, z], [big, drawn.uniform(0.5, 3) * big, big], drawn.uniform(0, 90), material)
        case "slab":
            base = [x, drawn.choice([0, big]), z]
            return box(base, [2 * big, 0.1 * big, big], drawn.uniform(0, 90), material)
        case _:
            corners = [
                [drawn.uniform(-1, 1) * big + x, drawn.uniform(0, 3) * big, drawn.uniform(-1, 1) * big + z]
                for _ in range(3)
            ]
            return [triangle(*corners, material=material)]


def box(base: Vector, size: Vector, degrees: float, material: str) -> list[Json]:
    """Five sides of an upright box on a base point: the sixth is never seen."""
    turn = math.radians(degrees)
    x = [size[0] * math.cos(turn), 0, size[0] * math.sin(turn)]
    z = [-size[2] * math.sin(turn), 0, size[2] * math.cos(turn)]
    y = [0, size[1], 0]
    corner = [base[i] - (x[i] + z[i]) / 2 for i in range(3)]

    def moved(edge: Vector) -> Vector:
        return [corner[i] + edge[i] for i in range(3)]

    sides = ((corner, x, y), (moved(z), x, y), (corner, z, y), (moved(x), z, y), (moved(y), x, z))
    return [sheet(*side, material) for side in sides]


def fence(drawn: Random, size: float) -> list[Json]:
    """Rails and posts, upright sheets far thinner than they are long."""
    count, wide = drawn.randrange(5, 20), size * drawn.choice([0.001, 0.003, 0.01])
    left, z, high = -drawn.uniform(0.2, 0.6) * size, drawn.uniform(-0.5, 0.3) * size, 0.08 * size
    length = drawn.uniform(0.4, 1.0) * size
    posts = [left + length * n / (count - 1) for n in range(count)]
    material = drawn.choice(["matte", "thing0"])
    slope = drawn.uniform(-0.3, 0.3)
    across = [length, 0, slope * length]
    upright = [sheet([x, 0, z + slope * (x - left)], [wide, 0, 0], [0, high, 0], material) for x in posts]
    return upright + [sheet([left, y * high, z], across, [0, wide, 0], material) for y in (0.4, 0.9)]


def plants(drawn: Random, size: float) -> list[Json]:
    """Thin stalks and blades: triangles and drawn-out ellipsoids."""
    found = []
    for _ in range(drawn.randrange(5, 25)):
        x, z = drawn.uniform(-0.5, 0.5) * size, drawn.uniform(-0.5, 0.5) * size
        high, thin = drawn.uniform(0.05, 0.3) * size, size * drawn.choice([0.0005, 0.002, 0.005])
        material = drawn.choice(["matte", "thing1"])
        if drawn.random() < 0.5:
            lean = drawn.uniform(-0.3, 0.3) * high
            found.append(triangle([x - thin, 0, z], [x + thin, 0, z], [x + lean, high, z], material=material))
        else:
            axes = [thin, 0, 0], [0, high / 2, 0], [0, 0, thin]
            found.append(ellipsoid([x, high / 2, z], *axes, material=material))
    return found


def block(drawn: Random, size: float) -> list[Json]:
    """A few houses."""
    found = []
    for _ in range(drawn.randrange(2, 5)):
        place = [drawn.uniform(-0.5, 0.5) * size, 0, drawn.uniform(-0.6, 0.2) * size]
        sides = [drawn.uniform(*span) * size for span in ((0.02, 0.2), (0.05, 0.3), (0.02, 0.2))]
        found += box(place, sides, drawn.uniform(0, 90), drawn.choice(["matte", "wall", "thing2"]))
    return found


def panel(drawn: Random, x: float, material: str) -> Json:
    """A board that leans on a wall."""
    side, lean = drawn.uniform(0.7, 1.2), drawn.uniform(0, 0.4)
    return sheet([x - side / 2, 0.3, lean], [side, 0, 0], [0, side, -lean], material)
