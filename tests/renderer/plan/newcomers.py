"""A kind of shape and a kind of material that the package does not have, each one class and one line.

The shape is a tube without ends. The material is Minnaert's (1941), the darkening of the moon's limb:
k albedo (n . l)^(k + 1) (n . v)^k.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from renderer.interaction import Points, Rays
from renderer.lights.view import LightView
from renderer.materials.reflection import Term
from renderer.math.arrays import (
    Floats,
    Integers,
    Masks,
    add,
    columns,
    cross,
    dot,
    magnitude,
    put,
    taken,
    unit,
)
from renderer.plan.effects import MaterialEffect, ShapeEffect
from renderer.shapes import Family
from renderer.shapes.family import SINGLE_PRIMITIVE, box
from renderer.shapes.frames import frame_of_normals
from schemas.base import Closed
from schemas.materials import Material, Surface
from schemas.quantities import Edge, Intensity, Name, Point, Size
from schemas.scene import Scene
from schemas.shapes import Shape
from tests.pictures import literal_surfaces as literal
from tests.pictures.literal_surfaces import V


class Tube(Closed):
    """The part of a round cylinder along `axis` from `base` on, open at both ends."""

    type: Literal["tube"]
    name: Name | None = None
    material: Name
    base: Point
    axis: Edge
    radius: Size

    def faces(self, margin: float) -> list[literal.Surface]:
        """As `literal` draws it."""
        along, radius = literal.unit(self.axis), self.radius + margin
        height = literal.length(self.axis)

        def across(v: V) -> V:
            return literal.sub(v, literal.mul(along, literal.dot(v, along)))

        def distances(origin: V, direction: V) -> list[float]:
            away = literal.sub(origin, self.base)
            o, d = across(away), across(direction)
            a, b, c = literal.dot(d, d), literal.dot(o, d), literal.dot(o, o) - radius**2
            if a == 0 or b * b < a * c:
                return []
            roots = [(-b + sign * math.sqrt(b * b - a * c)) / a for sign in (-1, 1)]
            at = [literal.dot(literal.add(away, literal.mul(direction, t)), along) for t in roots]
            return [t for t, up in zip(roots, at, strict=True) if -margin <= up <= height + margin]

        def details(place: V) -> tuple[V, V, V, float, float]:
            away = literal.sub(place, self.base)
            normal = literal.unit(across(away))
            return normal, normal, literal.cross(along, normal), 0.0, literal.dot(away, along) / height

        return [literal.Surface(distances, details, planar=False)]


class Minnaert(Surface):
    """Reflects k albedo (n . l)^(k + 1) (n . v)^k of the light."""

    type: Literal["minnaert"]
    albedo: Intensity
    darkening: Intensity

    def reflected(self, color: V, normal: V, l: V, viewer: V) -> V:
        """As `literal` draws it."""
        k = self.darkening
        return literal.mul(
            color, self.albedo * literal.dot(normal, l) ** (k + 1) * literal.dot(normal, viewer) ** k
        )


class LargerScene(Scene):
    """A scene of a larger language."""

    shapes: tuple[Tube | Shape, ...]  # type: ignore[assignment]
    materials: dict[Name, Minnaert | Material]  # type: ignore[assignment]


@dataclass(slots=True, eq=False)
class Tubes(Family):
    """A family of tubes, in frames of their own: (x, y) across in radii, z along in heights.

    Attributes
    ----------
    bases : (3, K) float64
    axes : (3, 3, K) float64
        Two radii and the axis.
    """

    bases: Floats
    axes: Floats

    def corners(self) -> Floats:
        return box(self.bases + self.axes[2] / 2, self.axes * np.array([1.0, 1.0, 0.5])[:, None, None])

    @property
    def surface(self) -> str:
        return "tube"

    def coincide(self, own: Integers, other: Family, others: Integers) -> Masks:
        assert isinstance(other, Tubes)
        alike: Masks = (self.axes[..., own] == other.axes[..., others]).all(axis=(0, 1))
        return alike & (self.bases[:, own] == other.bases[:, others]).all(axis=0)

    def shades_itself(self, viewer: Floats | None) -> bool:
        return True

    def smooth_shapes(self) -> Integers:
        return self.numbers[:0]

    def _local(self, vectors: Floats, shapes: Integers) -> Floats:
        axes = taken(self.axes, shapes)
        return np.stack([dot(vectors, axis) / dot(axis, axis) for axis in axes])

    def intersect(self, shape: int, rays: Rays) -> None:
        one = np.array([shape])
        origin = self._local(rays.origins - taken(self.bases, one), one)
        way = self._local(rays.directions, one)
        origin = np.broadcast_to(origin, way.shape)
        a = way[0] ** 2 + way[1] ** 2
        b = origin[0] * way[0] + origin[1] * way[1]
        radius = np.hypot(origin[0], origin[1])
        c = (radius - 1) * (radius + 1)
        if rays.origin_surfaces is not None:
            c = np.where(rays.origin_surfaces.shapes == self.numbers[shape], 0.0, c)
        # b b - a c, without squares that cancel.
        turn = origin[0] * way[1] - origin[1] * way[0]
        root = np.sqrt(np.maximum(a - turn**2, 0.0))
        seen = np.flatnonzero((a > 0) & (np.abs(turn) <= np.sqrt(a)))
        with np.errstate(divide="ignore", invalid="ignore"):
            far = -(b + np.copysign(root, b))
            roots = np.stack((far / a, np.where(far == 0, 0.0, c / far)))
        for t in np.sort(roots, axis=0)[::-1]:
            height = origin[2] + t * way[2]
            hit = seen[(t[seen] > 0) & (height[seen] >= 0) & (height[seen] <= 1)]
            x, y = (origin[axis] + t * way[axis] for axis in (0, 1))
            angle = np.arctan2(y, x)[hit] / (2 * np.pi) % 1.0
            rays.offer(hit, t[hit], (angle, height[hit]), self.numbers[shape : shape + 1], SINGLE_PRIMITIVE)

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        angle, height = points.hits[:2, chosen] * np.array([[2 * np.pi], [1.0]])
        first, second, axis = taken(self.axes, shapes)
        outward = np.cos(angle) * first + np.sin(angle) * second
        put(points.positions, chosen, taken(self.bases, shapes) + outward + height * axis)
        normals = unit(outward)
        points.face_rays(chosen, normals, dot(taken(points.directions, chosen), normals) > 0)

    def frames(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        by_u, _ = self.derivatives(points, chosen, shapes)
        return unit(by_u), np.ones(chosen.size)

    def derivatives(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        angle = 2 * np.pi * points.hits[0, chosen]
        first, second, axis = taken(self.axes, shapes)
        return 2 * np.pi * (np.cos(angle) * second - np.sin(angle) * first), axis


def build_tubes(numbers: Sequence[int], tubes: Sequence[Tube], assets: Any) -> Tubes:
    bases, axes = columns([tube.base for tube in tubes]), columns([tube.axis for tube in tubes])
    radii = np.array([tube.radius for tube in tubes])
    first = frame_of_normals(unit(axes))
    frames = np.stack((radii * first, radii * cross(unit(axes), first), axes))
    sizes = magnitude(bases) + magnitude(axes) + 2 * radii
    return Tubes("tube", np.array(numbers), sizes, bases, frames)


@dataclass(frozen=True, slots=True, eq=False)
class MinnaertTerm:
    """Stage of a light: Minnaert's law, for some materials."""

    adds: ClassVar[Literal["diffuse"]] = "diffuse"
    albedos: Floats
    darkenings: Floats

    def run(self, view: LightView) -> None:
        materials = view.of_points(view.points.materials)
        normals = view.of_points(view.points.shading_normals)
        cosines = view.cosines(normals, view.pairs("cosines"))
        powers = self.darkenings[materials]
        np.power(cosines, (powers + 1).astype(cosines.dtype), out=cosines)
        seen = np.maximum(dot(normals, view.of_points(view.points.viewers)), 0) ** powers
        share = view.mean(cosines) * self.albedos[materials] * seen
        add(
            view.points.radiance, view.chosen, view.emitter.color * view.of_points(view.points.colors) * share
        )


def minnaert_terms(materials: Sequence[Surface], dtype: np.dtype[np.floating]) -> list[Term]:
    numbers = [(m.albedo, m.darkening) if isinstance(m, Minnaert) else (0.0, 0.0) for m in materials]
    albedos, darkenings = np.array(numbers).T
    term = MinnaertTerm(albedos, darkenings)
    return [Term(term, "Minnaert term", "powers", albedos > 0, 1.0, viewed=True)]


TUBE = ShapeEffect(build_tubes, Tubes, meshed=False)
MINNAERT = MaterialEffect(
    reflects=lambda material: material.albedo > 0,
    terms=minnaert_terms,
    brightest=lambda material, light, color: light * material.albedo * color,
    curvature=lambda material: 2.0 * (1 + material.darkening) ** 2,
)
