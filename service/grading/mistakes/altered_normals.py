"""Wrong normals: not normalised, or computed as if every ellipsoid were a sphere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from renderer.math.arrays import Floats
from schemas.scene import Scene
from schemas.shapes import Ellipsoid, Parallelogram, Rectangle, Triangle

Bend = Callable[[Any, Floats, Floats], Floats]
"""Maps a shape, and the positions and normals (N, 3) of its hits, to other normals."""

ROUND = "ellipsoid"


def bent(bend: Bend, document: Scene, shapes: Any, places: Floats, normals: Floats) -> Floats:
    """Wrong normals of hits with the shapes of these numbers, (N, 3), on the same side as the right ones."""
    changed = normals.copy()
    for number, shape in enumerate(document.shapes):
        seen = np.flatnonzero(shapes == number)
        if seen.size:
            changed[seen] = bend(shape, places[seen], normals[seen])
    turned = (changed * normals).sum(axis=1, keepdims=True) < 0
    return np.where(turned, -changed, changed)


def from_center(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Not normalised: p - center on an ellipsoid, the cross product of the edges on a flat shape."""
    return places - np.array(shape.center) if shape.type == ROUND else normals * _area(shape)


def of_gradient(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Not normalised: M^-T x for x on the unit sphere, the cross product of the edges on a flat shape."""
    if shape.type != ROUND:
        return normals * _area(shape)
    inverse = np.linalg.inv(_axes(shape).T)
    gradient: Floats = (places - np.array(shape.center)) @ inverse.T @ inverse
    return gradient


def of_sphere(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Of unit length, but along p - center on an ellipsoid."""
    if shape.type != ROUND:
        return normals
    away = places - np.array(shape.center)
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def _axes(shape: Any) -> Floats:
    return np.array(shape.axes) if isinstance(shape, Ellipsoid) else np.eye(3) * shape.radius


def _area(shape: Triangle | Rectangle | Parallelogram) -> float:
    """Length of the cross product of the two edges."""
    if isinstance(shape, Rectangle):
        return shape.size[0] * shape.size[1]
    if isinstance(shape, Parallelogram):
        return float(np.linalg.norm(np.cross(*shape.edges)))
    a, b, c = np.array(shape.vertices)
    return float(np.linalg.norm(np.cross(b - a, c - a)))
