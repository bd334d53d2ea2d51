"""The pictures of the scene language, drawn as literally as its document reads.

One sample, one face, one light point at a time, in Python's floats, with the formulas of text books: it
shares no line and no idea with the package that it checks. It knows the fixed patterns only.
"""

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from schemas.scene import Scene
from tests.pictures.literal_surfaces import (
    V,
    add,
    cross,
    dot,
    edges,
    faces_of,
    handedness,
    mul,
    rectangle,
    sub,
    unit,
)

Codes = Sequence[Sequence[Sequence[int]]]
"""A picture file as rows of pixels of three codes 0..255, the top row first."""

TOUCH = 1e-11
"""A point this close to an end of a segment, in shares of it, touches the end and is not between."""


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
        turned.append(
            (
                (x * math.cos(angle) - y * math.sin(angle) + 0.5) % 1,
                (x * math.sin(angle) + y * math.cos(angle) + 0.5) % 1,
            )
        )
    return turned


class Drawing:
    """A scene, and the codes of the picture files that it names.

    `margin` makes all shapes larger, in scene units, and `horizon` raises the horizons of surfaces: what they
    change lies next to a border.
    """

    def __init__(
        self,
        scene: Scene,
        files: Mapping[str, Codes] | None = None,
        *,
        margin: float = 0.0,
        horizon: float = 0.0,
    ) -> None:
        self.scene, self.files, self.horizon = scene, files or {}, horizon
        self.sample = (0, 0)
        """Number of the pixel and of the sample in it that is being drawn."""
        self.surfaces = [
            replace(face, shape=number)
            for number, shape in enumerate(scene.shapes)
            for face in faces_of(shape, self.height(shape), margin)
        ]
        self.lamps = [rectangle(x) if x.type == "rectangle" else None for x in scene.lights]
        self.texels = {
            name: decoded(texture, self.files[texture.asset])
            for name, texture in scene.textures.items()
            if texture.type == "image"
        }

    def height(self, shape: Any) -> float:
        """Distance by which a displacement map of one colour moves a shape."""
        material = self.scene.materials[shape.material]
        if not material.displacement_map:
            return 0.0
        rows = self.files[self.scene.textures[material.displacement_map].asset]
        (code,) = {code for row in rows for texel in row for code in texel}
        return material.displacement_height * code / 255

    def material(self, number: int) -> Any:
        """Of a surface."""
        return self.scene.materials[self.scene.shapes[self.surfaces[number].shape].material]

    def samples(self) -> list[list[list[V]]]:
        """Radiance of every camera sample: rows of pixels of samples."""
        return [
            [self.pixel(i, j) for i in range(self.scene.camera.width)]
            for j in range(self.scene.camera.height)
        ]

    def pixel(self, i: int, j: int) -> list[V]:
        """Radiance of the samples of the pixel in column i and row j."""
        camera, chosen = self.scene.camera, self.scene.sampling.antialiasing
        f = unit(sub(camera.look_at, camera.position))
        r = unit(cross(f, camera.up))
        u, h = cross(r, f), math.tan(math.radians(camera.vertical_fov) / 2)
        values = []
        for number, (a, b) in enumerate(places(chosen.pattern, chosen.samples)):
            self.sample = (j * camera.width + i, number)
            x = h * (camera.width / camera.height) * (2 * (i + a) / camera.width - 1)
            y = h * (1 - 2 * (j + b) / camera.height)
            values.append(self.seen(camera.position, add(f, add(mul(r, x), mul(u, y)))))
        return values

    def seen(self, origin: V, direction: V, bounced: tuple[int, int] = (-1, 0)) -> V:
        """Radiance along a ray: a surface's, a visible light's, or the background's.

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
        """Distance and number of the nearest surface; `left` is the one that the ray leaves, or -1.

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
        material = self.material(number)
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
        material = self.material(number)
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
        material = self.material(number)
        outward, normal, side, (u, v) = self.turned(number, place, viewer)
        color = material.color or self.looked_up(material.color_texture or "", u, v)
        total = product(product(self.scene.ambient, color), mul((1.0, 1.0, 1.0), material.ambient))
        for light in self.scene.lights:
            points = list(self.light_points(light, place))
            for towards, reach in points:
                l = unit(towards)
                risen = dot(mul(outward, side), l) > TOUCH + self.horizon and dot(normal, l) > self.horizon
                if not risen or self.behind(light, l):
                    continue
                if self.blocked(number, place, towards, reach):
                    continue
                share = self.falloff(light, towards) / len(points)
                reflected = by_phong if material.type == "phong" else type(material).reflected
                found = reflected(material, color, normal, l, viewer)
                total = add(total, mul(product(light.color, found), share))
        return total

    def light_points(self, light: Any, place: V) -> Iterator[tuple[V, float]]:
        """Vectors to the points of a light, and how many of these lengths away the light is."""
        if light.type in ("point", "spot"):
            yield sub(light.position, place), 1.0
        elif light.type == "directional":
            yield mul(light.direction, -1), math.inf
        else:
            corner, first, second = edges(light)
            for u, v in grid(self.scene.sampling.light.samples):
                yield sub(add(corner, add(mul(first, u), mul(second, v))), place), 1.0

    def falloff(self, light: Any, towards: V) -> float:
        """Factor of a light point by its cone, its distance and the slope of a rectangle."""
        share = self.in_cone(light, towards) if light.type == "spot" else 1.0
        if getattr(light, "falloff", "none") == "none":
            return share
        if light.type != "rectangle":
            return share / dot(towards, towards)
        _, first, second = edges(light)
        area = cross(first, second)
        return abs(dot(area, unit(towards))) / (math.pi * dot(towards, towards))

    def in_cone(self, light: Any, towards: V) -> float:
        """The spot's angular attenuation, as the specification of KHR_lights_punctual computes it."""
        inner, outer = (math.cos(math.radians(a)) for a in (light.inner_angle, light.outer_angle))
        scale = 1 / (inner - outer)
        found = dot(unit(light.direction), mul(unit(towards), -1)) * scale - outer * scale
        return min(max(found, 0.0), 1.0) ** 2

    def behind(self, light: Any, l: V) -> bool:
        if light.type != "rectangle" or light.two_sided:
            return False
        _, first, second = edges(light)
        return dot(unit(cross(first, second)), l) >= -self.horizon

    def blocked(self, own: int, place: V, towards: V, reach: float) -> bool:
        """Whether a surface lies strictly between. A plane does not block its own points; a ball may."""
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


def by_phong(material: Any, color: V, normal: V, l: V, viewer: V) -> V:
    """Reflected radiance of white light from l."""
    mirror = sub(mul(normal, 2 * dot(normal, l)), l)
    gloss = max(0.0, dot(mirror, viewer))
    high = material.specular * (gloss**material.shininess if gloss > 0 else 0.0)
    return add(mul(color, material.diffuse * dot(normal, l)), (high, high, high))


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
