"""Shapes of a student's ray tracer: many rays at once, one shape at a time; mistakes are made by name."""

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray
Json = dict[str, Any]
Wrong = AbstractSet[str]

START = 1e-6
"""Smallest t of a hit; nearer ones are the surface at which the ray starts."""


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i", a, b)


def least(wrong: Wrong) -> float:
    """The t that hits must exceed."""
    return -np.inf if "behind" in wrong else 0.0 if "acne" in wrong else START


@dataclass
class Ball:
    """An ellipsoid: the unit sphere transformed by a matrix whose columns are the semi-axes."""

    center: Array
    matrix: Array

    def __post_init__(self) -> None:
        self.inverse = np.linalg.inv(self.matrix)

    def distances(self, origins: Array, directions: Array, wrong: Wrong) -> Array:
        o, d = (origins - self.center) @ self.inverse.T, directions @ self.inverse.T
        if "far_single" in wrong:
            o, d = o.astype(np.float32), d.astype(np.float32)
        a, b, c = dot(d, d), 2 * dot(o, d), dot(o, o) - 1
        under = b * b - 4 * a * c
        root = np.sqrt(np.maximum(under, 0))
        near, far = (-b - root) / (2 * a), (-b + root) / (2 * a)
        start = least(wrong)
        t = np.where(near > start, near, np.where(far > start, far, np.inf))
        return np.where(under >= 0, t, np.inf).astype(float)

    def normals(self, places: Array, wrong: Wrong) -> Array:
        """Outward normals."""
        if "normal_like_points" in wrong:
            return unit(places - self.center)
        normals = (places - self.center) @ self.inverse.T @ self.inverse
        return normals if "normals_not_normalised" in wrong else unit(normals)

    def coordinates(self, places: Array) -> Array:
        """Longitude and latitude, scaled to 0..1."""
        x, y, z = ((places - self.center) @ self.inverse.T).T
        return np.stack((np.arctan2(y, x) / (2 * np.pi) % 1, np.arccos(np.clip(-z, -1, 1)) / np.pi), axis=-1)


@dataclass
class Flat:
    """A parallelogram with a corner and two edges, or its half, a triangle."""

    corner: Array
    first: Array
    second: Array
    half: bool

    def __post_init__(self) -> None:
        self.normal = np.cross(self.first, self.second)
        sides = np.cross(self.second, self.normal), np.cross(self.normal, self.first)
        self.to_weights = np.stack(sides, axis=-1) / (self.normal @ self.normal)

    def distances(self, origins: Array, directions: Array, wrong: Wrong) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self.corner - origins) @ self.normal / (directions @ self.normal)
            u, v = self.coordinates(origins + t[:, None] * directions).T
        inside = (u >= 0) & (v >= 0)
        if self.half and "triangle_too_large" not in wrong:
            inside &= u + v <= 1
        else:
            inside &= (u <= 1) & (v <= 1)
        return np.where(inside & (t > least(wrong)), t, np.inf)

    def normals(self, places: Array, wrong: Wrong) -> Array:
        normal = self.normal if "normals_not_normalised" in wrong else unit(self.normal)
        return np.broadcast_to(normal, places.shape)

    def coordinates(self, places: Array) -> Array:
        """Coordinates along both edges, (N, 2)."""
        return (places - self.corner) @ self.to_weights


def shape_of(document: Json) -> Ball | Flat:
    if document["type"] == "triangle":
        a, b, c = (np.array(vertex, float) for vertex in document["vertices"])
        return Flat(a, b - a, c - a, half=True)
    if document["type"] == "rectangle":
        corner, edges = np.array(document["corner"], float), np.array(document["edges"], float)
        return Flat(corner, edges[0], edges[1], half=False)
    axes = document.get("axes") or np.eye(3) * document["radius"]
    return Ball(np.array(document["center"], float), np.array(axes, float).T)
