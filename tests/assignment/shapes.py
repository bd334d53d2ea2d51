"""Shapes of a simple ray tracer, as a course teaches them: many rays at once, one shape at a time.

It shares no code with the package that grades it. Each mistake has a name, and an `if` beside the correct
code.
"""

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray
Wrong = AbstractSet[str]

START = 1e-6
"""Smallest t of a hit; nearer ones are the surface at which the ray starts."""

OFFSET = 1e-4
"""Offset of the origin of shadow rays from the surface, in scene units."""


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1)


def least(wrong: Wrong) -> float:
    """The t that hits must exceed."""
    return -np.inf if "behind" in wrong else 0.0 if "acne" in wrong else START


@dataclass
class Ball:
    """An ellipsoid: the unit sphere transformed by a matrix whose columns are the semi-axes."""

    center: Array
    matrix: Array

    def distances(self, origins: Array, directions: Array, wrong: Wrong) -> Array:
        inverse = np.linalg.inv(self.matrix)
        o, d = (origins - self.center) @ inverse.T, directions @ inverse.T
        if "far_single" in wrong:
            o, d = o.astype(np.float32), d.astype(np.float32)
        a, b, c = dot(d, d), 2 * dot(o, d), dot(o, o) - 1
        under = b * b - 4 * a * c
        root = np.sqrt(np.maximum(under, 0))
        near, far = (-b - root) / (2 * a), (-b + root) / (2 * a)
        if "second_root" in wrong:
            near = far
        start = least(wrong)
        t = np.where(near > start, near, np.where(far > start, far, np.inf))
        return np.where(under >= 0, t, np.inf).astype(float)

    def normals(self, places: Array, wrong: Wrong) -> Array:
        """Outward normals."""
        local = (places - self.center) @ np.linalg.inv(self.matrix).T
        if "normal_like_points" in wrong:
            return unit(places - self.center)
        normals = local @ np.linalg.inv(self.matrix)
        return normals if "normals_not_normalised" in wrong else unit(normals)

    def coordinates(self, places: Array) -> Array:
        """Longitude and latitude, scaled to 0..1."""
        x, y, z = ((places - self.center) @ np.linalg.inv(self.matrix).T).T
        return np.stack((np.arctan2(y, x) / (2 * np.pi) % 1, np.arccos(np.clip(-z, -1, 1)) / np.pi), axis=-1)


@dataclass
class Flat:
    """A parallelogram with a corner and two edges, or its half, a triangle."""

    corner: Array
    first: Array
    second: Array
    half: bool

    def distances(self, origins: Array, directions: Array, wrong: Wrong) -> Array:
        normal = np.cross(self.first, self.second)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = dot(normal, self.corner - origins) / dot(normal, directions)
            u, v = self.weights(origins + t[:, None] * directions)
        inside = (u >= 0) & (v >= 0)
        if self.half and "triangle_too_large" not in wrong:
            inside &= u + v <= 1
        else:
            inside &= (u <= 1) & (v <= 1)
        start = least(wrong)
        return np.where(inside & (t > start), t, np.inf)

    def weights(self, places: Array) -> tuple[Array, Array]:
        normal = np.cross(self.first, self.second)
        away, area = places - self.corner, normal @ normal
        return np.cross(away, self.second) @ normal / area, np.cross(self.first, away) @ normal / area

    def normals(self, places: Array, wrong: Wrong) -> Array:
        normal = np.cross(self.first, self.second)
        if "normals_not_normalised" not in wrong:
            normal = unit(normal)
        return np.broadcast_to(normal, places.shape)

    def coordinates(self, places: Array) -> Array:
        return np.stack(self.weights(places), axis=-1)


def shape_of(document: dict[str, Any]) -> Ball | Flat:
    if document["type"] == "triangle":
        a, b, c = (np.array(vertex, float) for vertex in document["vertices"])
        return Flat(a, b - a, c - a, half=True)
    if document["type"] == "rectangle":
        corner, edges = np.array(document["corner"], float), np.array(document["edges"], float)
        return Flat(corner, edges[0], edges[1], half=False)
    axes = document.get("axes") or np.eye(3) * document["radius"]
    return Ball(np.array(document["center"], float), np.array(axes, float).T)
