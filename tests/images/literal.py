"""The pictures of the scene language, drawn as literally as its document reads.

One sample, one shape, one light point at a time, in Python's floats, with the formulas of text books: it
shares no line and no idea with the package that it checks. It knows the fixed patterns only.
"""

import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from schemas.scene import Scene

V = tuple[float, float, float]
Codes = Sequence[Sequence[Sequence[int]]]
"""A picture file as rows of pixels of three codes 0..255, the top row first."""

TOUCH = 1e-11
"""What lies this close to an end of a segment, in shares of it, touches the end and is not between."""


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


def unit(a: V) -> V:
    return mul(a, 1 / math.sqrt(dot(a, a)))


@dataclass
class Surface:
    """What a hit needs: distances to it along a ray, then its outward normal, uv and tangent at a place."""

    distances: Callable[[V, V], list[float]]
    details: Callable[[V], tuple[V, V, V, float, float]]
    """Place -> geometric normal, shading normal, tangent, u, v; all on the outward side."""
    planar: bool


def flat(corner: V, first: V, second: V, inside: Callable[[float, float], bool]) -> tuple[Any, Any]:
    """The plane corner + u first + v second: distances of hits inside, and (u, v) of a place (Cramer)."""
    normal = cross(first, second)

    def weights(place: V) -> tuple[float, float]:
        away = sub(place, corner)
        area = dot(normal, normal)
        return dot(cross(away, second), normal) / area, dot(cross(first, away), normal) / area

    def distances(origin: V, direction: V) -> list[float]:
        slope = dot(normal, direction)
        if slope == 0:
            return []
        t = dot(normal, sub(corner, origin)) / slope
        return [t] if inside(*weights(add(origin, mul(direction, t)))) else []

    return distances, weights


def rectangle(shape: Any) -> Surface:
    corner, first, second = edges(shape)
    distances, weights = flat(corner, first, second, lambda u, v: 0 <= u <= 1 and 0 <= v <= 1)
    normal = unit(cross(first, second))
    return Surface(distances, lambda place: (normal, normal, unit(first), *weights(place)), planar=True)


def edges(shape: Any) -> tuple[V, V, V]:
    if hasattr(shape, "corner"):
        return shape.corner, shape.edges[0], shape.edges[1]
    normal = unit(shape.normal)
    tangent = unit(sub(shape.tangent, mul(normal, dot(shape.tangent, normal))))
    first, second = mul(tangent, shape.size[0]), mul(cross(normal, tangent), shape.size[1])
    return sub(shape.center, mul(add(first, second), 0.5)), first, second


def triangle(shape: Any) -> Surface:
    a, b, c = shape.vertices
    ab, ac = sub(b, a), sub(c, a)
    distances, weights = flat(a, ab, ac, lambda u, v: u >= 0 and v >= 0 and u + v <= 1)
    normal = unit(cross(ab, ac))
    uvs = shape.uvs or ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    du, dv = [[uvs[i][k] - uvs[0][k] for i in (1, 2)] for k in (0, 1)]
    turn = du[0] * dv[1] - du[1] * dv[0]
    tangent = unit(mul(sub(mul(ab, dv[1]), mul(ac, dv[0])), 1 / turn))

    def details(place: V) -> tuple[V, V, V, float, float]:
        second, third = weights(place)
        parts = (1 - second - third, second, third)
        u, v = (sum(w * uv[k] for w, uv in zip(parts, uvs, strict=True)) for k in (0, 1))
        smooth = normal
        if shape.normals:
            corners = [unit(given) for given in shape.normals]
            outward = dot(add(add(*corners[:2]), corners[2]), normal) >= 0
            smooth = (0.0, 0.0, 0.0)
            for weight, corner in zip(parts, corners, strict=True):
                smooth = add(smooth, mul(corner, weight if outward else -weight))
        return normal, unit(smooth), tangent, u, v

    return Surface(distances, details, planar=True)


def ellipsoid(shape: Any) -> Surface:
    r = getattr(shape, "radius", 0.0)
    axes = getattr(shape, "axes", ((r, 0.0, 0.0), (0.0, r, 0.0), (0.0, 0.0, r)))

    def local(vector: V) -> V:
        x, y, z = (dot(vector, axis) / dot(axis, axis) for axis in axes)
        return x, y, z

    def distances(origin: V, direction: V) -> list[float]:
        o, d = local(sub(origin, shape.center)), local(direction)
        a, b, c = dot(d, d), 2 * dot(o, d), dot(o, o) - 1
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


SURFACES = {"triangle": triangle, "rectangle": rectangle, "ellipsoid": ellipsoid}


def grid(samples: int) -> list[tuple[float, float]]:
    n = math.isqrt(samples)
    return [((i + 0.5) / n, (j + 0.5) / n) for j in range(n) for i in range(n)]


def places(pattern: str, samples: int) -> list[tuple[float, float]]:
    """Sub-pixel places of a fixed pattern; b counts downwards."""
    if pattern == "center":
        return [(0.5, 0.5)]
    if pattern == "uniform":
        return grid(samples)
    angle = math.atan(0.5)
    turned = []
    for a, b in grid(samples):
        x, y = a - 0.5, b - 0.5
        across = x * math.cos(angle) - y * math.sin(angle) + 0.5
        turned.append((across % 1, (x * math.sin(angle) + y * math.cos(angle) + 0.5) % 1))
    return turned


class Drawing:
    """A scene, and the codes of the picture files that it names."""

    def __init__(self, scene: Scene, files: Mapping[str, Codes] | None = None) -> None:
        self.scene = scene
        self.surfaces = [SURFACES[shape.type](shape) for shape in scene.shapes]
        self.lamps = [rectangle(x) if x.type == "rectangle" else None for x in scene.lights]
        self.texels = {
            name: decoded(texture, (files or {})[texture.asset])
            for name, texture in scene.textures.items()
            if texture.type == "image"
        }

    def samples(self) -> list[list[list[V]]]:
        """Radiance of every camera sample: rows of pixels of samples."""
        camera, chosen = self.scene.camera, self.scene.sampling.antialiasing
        f = unit(sub(camera.look_at, camera.position))
        r = unit(cross(f, camera.up))
        u, h = cross(r, f), math.tan(math.radians(camera.vertical_fov) / 2)
        rows = []
        for j in range(camera.height):
            row = []
            for i in range(camera.width):
                pixel = []
                for a, b in places(chosen.pattern, chosen.samples):
                    x = h * (camera.width / camera.height) * (2 * (i + a) / camera.width - 1)
                    y = h * (1 - 2 * (j + b) / camera.height)
                    pixel.append(self.seen(camera.position, add(f, add(mul(r, x), mul(u, y)))))
                row.append(pixel)
            rows.append(row)
        return rows

    def seen(self, origin: V, direction: V, bounced: tuple[int, int] = (-1, 0)) -> V:
        """Radiance along a ray: a shape's, a visible light's, or the background's.

        `bounced` is what the ray leaves, and how many bounces came before. Every ray is followed to the end.
        """
        nearest, number = self.nearest(origin, direction, bounced[0])
        glow, light = math.inf, None
        for source, lamp in zip(self.scene.lights, self.lamps, strict=True):
            for t in lamp.distances(origin, direction) if lamp and getattr(source, "visible", False) else ():
                if 0 < t < glow:
                    glow, light = t, source
        if light is not None and glow <= nearest * (1 + TOUCH):
            return light.color
        if number < 0:
            return self.scene.background
        place, viewer = add(origin, mul(direction, nearest)), mul(unit(direction), -1)
        total = self.shaded(number, place, viewer)
        for share, onward in self.onward(number, place, viewer, bounced[1]):
            if share > 0:
                total = add(total, mul(self.seen(place, onward, (number, bounced[1] + 1)), share))
        return total

    def nearest(self, origin: V, direction: V, left: int) -> tuple[float, int]:
        """Distance and number of the nearest shape; `left` is the shape that the ray leaves, or -1.

        A plane is not hit by the rays that leave it, nor an ellipsoid where they do.
        """
        nearest, number = math.inf, -1
        for i, surface in enumerate(self.surfaces):
            if i == left and surface.planar:
                continue
            least = TOUCH if left >= 0 else 0
            for t in surface.distances(origin, direction):
                if least < t < nearest:
                    nearest, number = t, i
        return nearest, number

    def onward(self, number: int, place: V, viewer: V, bounces: int) -> Iterator[tuple[float, V]]:
        """Shares and directions of the rays that Whitted's model sends on: mirrored, reflected, refracted."""
        material = self.scene.materials[self.scene.shapes[number].material]
        if bounces >= material.max_depth:
            return
        outward, normal, side = self.turned(number, place, viewer)[:3]
        front = mul(outward, side)
        mirrored = sub(mul(normal, 2 * dot(normal, viewer)), viewer)
        if dot(mirrored, front) < 0:
            mirrored = sub(mirrored, mul(front, 2 * dot(mirrored, front)))
        yield material.mirror, mirrored
        if material.transmission == 0:
            return
        before, behind = (1.0, material.ior) if side > 0 else (material.ior, 1.0)
        entering = math.acos(max(0.0, min(1.0, dot(normal, viewer))))
        sine = before * math.sin(entering) / behind
        if sine >= 1 and before != behind:
            yield material.transmission, mirrored
            return
        leaving = math.asin(min(1.0, sine))
        # Fresnel's formulas as in text books, by sine and tangent of the sum and difference of the angles.
        share = ((before - behind) / (before + behind)) ** 2
        if entering > 1e-4 and before != behind:
            across = math.sin(entering - leaving) / math.sin(entering + leaving)
            along = math.tan(entering - leaving) / math.tan(entering + leaving)
            share = (across**2 + along**2) / 2
        yield material.transmission * share, mirrored
        sideways = sub(mul(normal, math.cos(entering)), viewer)
        refracted = mul(normal, -math.cos(leaving))
        if dot(sideways, sideways) > 0:
            refracted = add(refracted, mul(unit(sideways), math.sin(leaving)))
        if dot(refracted, front) > 0:
            refracted = sub(refracted, mul(front, 2 * dot(refracted, front)))
        yield material.transmission * (1 - share), refracted

    def turned(self, number: int, place: V, viewer: V) -> tuple[V, V, float, tuple[float, float]]:
        """Outward normal, shading normal on the viewer's side, which side that is, and uv."""
        material = self.scene.materials[self.scene.shapes[number].material]
        outward, shading, tangent, u, v = self.surfaces[number].details(place)
        side = 1.0 if dot(outward, viewer) > 0 else -1.0
        if material.normal_map:
            hand = handedness(self.surfaces[number], place)
            shading = self.mapped(material.normal_map, shading, tangent, (u, v), hand)
        normal = mul(shading, side)
        if dot(normal, viewer) < 0:
            # Bent to the horizon: what is seen does not face away.
            normal = unit(sub(normal, mul(viewer, dot(normal, viewer))))
        return outward, normal, side, (u, v)

    def shaded(self, number: int, place: V, viewer: V) -> V:
        """Ambient term plus, for each light, the mean over its points."""
        material = self.scene.materials[self.scene.shapes[number].material]
        outward, normal, side, (u, v) = self.turned(number, place, viewer)
        color = material.color or self.looked_up(material.color_texture or "", u, v)
        total = product(product(self.scene.ambient, color), mul((1.0, 1.0, 1.0), material.ambient))
        for light in self.scene.lights:
            points = list(self.light_points(light, place))
            for towards, reach in points:
                l = unit(towards)
                if dot(mul(outward, side), l) <= TOUCH or dot(normal, l) <= 0 or self.behind(light, l):
                    continue
                if self.blocked(number, place, towards, reach):
                    continue
                mirror = sub(mul(normal, 2 * dot(normal, l)), l)
                gloss = max(0.0, dot(mirror, viewer))
                high = material.specular * (gloss**material.shininess if gloss > 0 else 0.0)
                matt = mul(color, material.diffuse * dot(normal, l))
                total = add(total, mul(product(light.color, add(matt, (high, high, high))), 1 / len(points)))
        return total

    def light_points(self, light: Any, place: V) -> Iterator[tuple[V, float]]:
        """Vectors to the points of a light, and how many of these lengths away the light is."""
        if light.type == "point":
            yield sub(light.position, place), 1.0
        elif light.type == "directional":
            yield mul(light.direction, -1), math.inf
        else:
            corner, first, second = edges(light)
            for u, v in grid(self.scene.sampling.light.samples):
                yield sub(add(corner, add(mul(first, u), mul(second, v))), place), 1.0

    def behind(self, light: Any, l: V) -> bool:
        if light.type != "rectangle" or light.two_sided:
            return False
        _, first, second = edges(light)
        return dot(cross(first, second), l) >= 0

    def blocked(self, own: int, place: V, towards: V, reach: float) -> bool:
        """Whether a shape lies strictly between. A plane does not block its own points; an ellipsoid may."""
        for i, surface in enumerate(self.surfaces):
            if i == own and surface.planar:
                continue
            if any(TOUCH < t < reach * (1 - TOUCH) for t in surface.distances(place, towards)):
                return True
        return False

    def looked_up(self, name: str, u: float, v: float) -> V:
        texture = self.scene.textures[name]
        if texture.type == "checker":
            fields = math.floor(u * texture.repeat[0]) + math.floor(v * texture.repeat[1])
            return texture.odd if fields % 2 else texture.even
        texels = self.texels[name]
        height, width = len(texels), len(texels[0])
        # Row 0 of the file is at v = 1.
        x, y = u * width, (1 - v) * height

        def texel(i: int, j: int) -> V:
            return texels[wrapped(texture.wrap, j, height)][wrapped(texture.wrap, i, width)]

        if texture.filter == "nearest":
            return texel(math.floor(x), math.floor(y))
        i, j = math.floor(x - 0.5), math.floor(y - 0.5)
        a, b = x - 0.5 - i, y - 0.5 - j
        total = (0.0, 0.0, 0.0)
        for k, weight_x in ((i, 1 - a), (i + 1, a)):
            for m, weight_y in ((j, 1 - b), (j + 1, b)):
                total = add(total, mul(texel(k, m), weight_x * weight_y))
        return total

    def mapped(self, name: str, outward: V, tangent: V, uv: tuple[float, float], hand: float) -> V:
        """The normal 2 c - 1 of a normal map, on the outward side."""
        tangent = unit(sub(tangent, mul(outward, dot(tangent, outward))))
        x, y, z = (2 * c - 1 for c in self.looked_up(name, *uv))
        if x * x + y * y + z * z < 1e-3:
            x, y, z = 0.0, 0.0, 1.0
        return unit(add(mul(tangent, x), add(mul(cross(outward, tangent), y * hand), mul(outward, z))))


def product(a: V, b: V) -> V:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def wrapped(wrap: str, index: int, size: int) -> int:
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    if wrap == "repeat":
        return index % size
    index %= 2 * size
    return index if index < size else 2 * size - 1 - index


def decoded(texture: Any, codes: Codes) -> list[list[V]]:
    """Linear texels, rounded to the float32 that they are held in."""

    def linear(code: int) -> float:
        (x,) = struct.unpack("f", struct.pack("f", code / 255))
        if texture.encoding == "srgb":
            x = x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4
        return float(struct.unpack("f", struct.pack("f", x))[0])

    return [[(linear(r), linear(g), linear(b)) for r, g, b in row] for row in codes]
