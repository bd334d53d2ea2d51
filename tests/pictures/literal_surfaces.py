"""Surfaces as `literal` draws them: where a ray meets them, and what is there, by the formulas of text books.

Each may be drawn larger on all sides by a margin, which shows what lies next to a border.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

V = tuple[float, float, float]
UVS = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
"""Texture coordinates of the corners of a triangle that has none."""


def add(a: V, b: V) -> V:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def sub(a: V, b: V) -> V:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def mul(a: V, s: float) -> V:
    return a[0] * s, a[1] * s, a[2] * s


def dot(a: V, b: V) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: V, b: V) -> V:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: V) -> float:
    return math.sqrt(dot(a, a))


def unit(a: V) -> V:
    return mul(a, 1 / length(a))


@dataclass
class Surface:
    """Ray distances of a surface, and its outward normal, uv and tangent at a place."""

    distances: Callable[[V, V], list[float]]
    details: Callable[[V], tuple[V, V, V, float, float]]
    """Place -> geometric normal, shading normal, tangent, u, v; all on the outward side."""
    planar: bool
    shape: int = -1
    """Number of the shape that it is, or is a face of."""


def faces_of(shape: Any, height: float = 0.0, margin: float = 0.0) -> list[Surface]:
    """The surfaces of a shape, moved along their normals by a height."""
    match shape.type:
        case "triangle":
            return [triangle(shape, height, margin)]
        case "rectangle":
            return [rectangle(shape, height, margin)]
        case "ellipsoid":
            assert height == 0, "a moved ellipsoid is none"
            return [ellipsoid(shape, margin)]
        case "mesh":
            assert height == 0, "faces of a moved mesh come apart"
            return mesh(shape, margin)
        case _:
            assert height == 0, "only flat shapes are moved as a whole"
            faces: list[Surface] = shape.faces(margin)
            return faces


def flat(
    corner: V, first: V, second: V, inside: Callable[[float, float, float, float], bool], margin: float
) -> tuple[Any, Any]:
    """The plane corner + u first + v second: distances of hits inside, and (u, v) of a place (Cramer).

    `inside` is asked with u, v and what the margin is worth in each.
    """
    normal = cross(first, second)
    area = dot(normal, normal)
    room_u, room_v = (margin * length(edge) / math.sqrt(area) for edge in (second, first))

    def weights(place: V) -> tuple[float, float]:
        away = sub(place, corner)
        return dot(cross(away, second), normal) / area, dot(cross(first, away), normal) / area

    def distances(origin: V, direction: V) -> list[float]:
        slope = dot(normal, direction)
        if slope == 0:
            return []
        t = dot(normal, sub(corner, origin)) / slope
        return [t] if inside(*weights(add(origin, mul(direction, t))), room_u, room_v) else []

    return distances, weights


def rectangle(shape: Any, height: float = 0.0, margin: float = 0.0) -> Surface:
    corner, first, second = edges(shape)
    normal = unit(cross(first, second))

    def inside(u: float, v: float, room_u: float, room_v: float) -> bool:
        return -room_u <= u <= 1 + room_u and -room_v <= v <= 1 + room_v

    distances, weights = flat(add(corner, mul(normal, height)), first, second, inside, margin)
    return Surface(distances, lambda place: (normal, normal, unit(first), *weights(place)), planar=True)


def edges(shape: Any) -> tuple[V, V, V]:
    if hasattr(shape, "corner"):
        return shape.corner, shape.edges[0], shape.edges[1]
    normal = unit(shape.normal)
    tangent = unit(sub(shape.tangent, mul(normal, dot(shape.tangent, normal))))
    first, second = mul(tangent, shape.size[0]), mul(cross(normal, tangent), shape.size[1])
    return sub(shape.center, mul(add(first, second), 0.5)), first, second


def triangle(shape: Any, height: float = 0.0, margin: float = 0.0) -> Surface:
    a, b, c = shape.vertices
    normal = unit(cross(sub(b, a), sub(c, a)))
    corners = None
    if shape.normals:
        corners = [unit(given) for given in shape.normals]
        if dot(add(add(*corners[:2]), corners[2]), normal) < 0:
            corners = [mul(corner, -1) for corner in corners]
    moved = [add(vertex, mul(normal, height)) for vertex in (a, b, c)]
    return face(moved, shape.uvs or UVS, corners, margin)


def face(vertices: Sequence[V], uvs: Any, normals: Sequence[V] | None, margin: float) -> Surface:
    """A triangle with unit normals at its corners, or its own."""
    a, b, c = vertices
    ab, ac = sub(b, a), sub(c, a)
    normal = unit(cross(ab, ac))
    third = margin * length(sub(c, b)) / length(cross(ab, ac))

    def inside(u: float, v: float, room_u: float, room_v: float) -> bool:
        return u >= -room_u and v >= -room_v and u + v <= 1 + third

    distances, weights = flat(a, ab, ac, inside, margin)
    du, dv = [[uvs[i][k] - uvs[0][k] for i in (1, 2)] for k in (0, 1)]
    turn = du[0] * dv[1] - du[1] * dv[0]
    tangent = unit(mul(sub(mul(ab, dv[1]), mul(ac, dv[0])), 1 / turn))

    def details(place: V) -> tuple[V, V, V, float, float]:
        second, third = weights(place)
        parts = (1 - second - third, second, third)
        u, v = (sum(w * uv[k] for w, uv in zip(parts, uvs, strict=True)) for k in (0, 1))
        smooth = (0.0, 0.0, 0.0) if normals else normal
        for weight, corner in zip(parts, normals or (), strict=bool(normals)):
            smooth = add(smooth, mul(corner, weight))
        return normal, unit(smooth), tangent, u, v

    return Surface(distances, details, planar=True)


def mesh(shape: Any, margin: float) -> list[Surface]:
    """A surface for each triangle."""
    vertices = [placed(vertex, shape) for vertex in shape.vertices]
    normals = smooth_normals(vertices, shape.triangles) if shape.smooth else None
    return [
        face(
            [vertices[i] for i in row],
            [shape.uvs[i] for i in row] if shape.uvs else UVS,
            normals and [normals[vertices[i]] for i in row],
            margin,
        )
        for row in shape.triangles
    ]


def placed(vertex: V, shape: Any) -> V:
    """A vertex scaled, turned about the origin, and moved."""
    scale = shape.scale if isinstance(shape.scale, Sequence) else (shape.scale,) * 3
    x = (vertex[0] * scale[0], vertex[1] * scale[1], vertex[2] * scale[2])
    if shape.rotate:
        axis, angle = unit(shape.rotate.axis), math.radians(shape.rotate.degrees)
        along = mul(axis, dot(axis, x))
        across = sub(x, along)
        turned = add(mul(across, math.cos(angle)), mul(cross(axis, across), math.sin(angle)))
        x = add(along, turned)
    return add(x, shape.translate)


def smooth_normals(vertices: Sequence[V], triangles: Sequence[Sequence[int]]) -> dict[V, V]:
    """By place: the mean over the triangles there, weighted by their angle at it."""
    total: dict[V, V] = {}
    for row in triangles:
        for k in range(3):
            here, after, before = (vertices[row[(k + step) % 3]] for step in range(3))
            one, other = unit(sub(after, here)), unit(sub(before, here))
            angle = math.acos(max(-1.0, min(1.0, dot(one, other))))
            part = mul(unit(cross(one, other)), angle)
            total[here] = add(total.get(here, (0.0, 0.0, 0.0)), part)
    return {place: unit(vector) for place, vector in total.items()}


def ellipsoid(shape: Any, margin: float = 0.0) -> Surface:
    r = getattr(shape, "radius", 0.0)
    axes = getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r)))
    larger = 1 + margin / min(length(axis) for axis in axes)

    def local(vector: V) -> V:
        x, y, z = (dot(vector, axis) / dot(axis, axis) for axis in axes)
        return x, y, z

    def distances(origin: V, direction: V) -> list[float]:
        o, d = local(sub(origin, shape.center)), local(direction)
        a, b, c = dot(d, d), 2 * dot(o, d), dot(o, o) - larger * larger
        if b * b < 4 * a * c:
            return []
        root = math.sqrt(b * b - 4 * a * c)
        return [(-b - root) / (2 * a), (-b + root) / (2 * a)]

    def details(place: V) -> tuple[V, V, V, float, float]:
        where = local(sub(place, shape.center))
        normal = (0.0, 0.0, 0.0)
        for x, axis in zip(where, axes, strict=True):
            normal = add(normal, mul(axis, x / dot(axis, axis)))
        angle = math.atan2(where[1], where[0])
        tangent = add(mul(axes[0], -math.sin(angle)), mul(axes[1], math.cos(angle)))
        u, v = (angle / (2 * math.pi)) % 1, math.acos(max(-1.0, min(1.0, -unit(where)[2]))) / math.pi
        return unit(normal), unit(normal), unit(tangent), u, v

    return Surface(distances, details, planar=False)


def handedness(surface: Surface, place: V) -> float:
    """1, or -1 where v grows against normal x tangent, as steps along both show."""
    normal, _, tangent, u, v = surface.details(place)
    steps = [surface.details(add(place, mul(way, 1e-6)))[3:] for way in (tangent, cross(normal, tangent))]
    (a, b), (c, d) = [((s - u + 0.5) % 1 - 0.5, t - v) for s, t in steps]
    return 1.0 if a * d >= b * c else -1.0
