"""Phong's model pair by pair: a unit vector to every light point, and the power of a clamped cosine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.textbook.pairs import light_places, ways
from benchmarks.textbook.single import Singles, buffer, dot
from renderer.materials.phong import Diffuse, Highlight
from renderer.math.arrays import add, taken
from renderer.math.arrays import dot as plain_dot

if TYPE_CHECKING:
    from renderer.lights.view import LightView
    from renderer.math.arrays import Integers


@dataclass(frozen=True, slots=True)
class TextbookDiffuse(Diffuse):
    """Stage of a light: Lambert's cosine."""

    def run(self, view: LightView) -> None:
        """Add the mean over light points of V * light * diffuse * color * max(0, n . l)."""
        points, chosen = view.points, view.chosen
        directions = _directions(view, np.arange(view.count))
        cosines = _cosines(view.of_points(points.shading_normals), directions)
        share = view.mean(cosines) * self.phong.diffuse[view.of_points(points.materials)]
        add(points.radiance, chosen, view.emitter.color * view.of_points(points.colors) * share)


@dataclass(frozen=True, slots=True)
class TextbookHighlight(Highlight):
    """Stage of a light: the highlight, at the points of materials that have one."""

    def run(self, view: LightView) -> None:
        """Add the mean over light points of V * light * specular * max(0, r . v)^shininess."""
        materials = view.of_points(view.points.materials)
        index = np.flatnonzero(self.phong.specular[materials] > 0)
        if not index.size:
            return
        chosen = view.chosen[index]
        normals, viewers = taken(view.points.shading_normals, chosen), taken(view.points.viewers, chosen)
        mirrored = 2 * plain_dot(normals, viewers) * normals - viewers
        directions = _directions(view, index)
        values = _cosines(mirrored, directions)
        np.power(values, self.phong.shininess[materials[index]], out=values)
        lit = dot(directions, normals, *(buffer(name, *values.shape) for name in ("lit", "spare"))) > 0
        if view.blocked is not None:
            lit &= ~np.take(view.blocked, index, axis=1)
        share = np.multiply(values, lit, out=values).mean(axis=0) * self.phong.specular[materials[index]]
        add(view.points.radiance, chosen, view.emitter.color * share)


def _directions(view: LightView, index: Integers) -> list[Singles]:
    """Unit vectors from some points to the light points, three buffers (L, n)."""
    directions = ways(taken(view.points.positions, view.chosen[index]), light_places(view, index))
    squares, spare = (buffer(name, *directions[0].shape) for name in ("squares", "spare"))
    lengths = np.sqrt(dot(directions, directions, squares, spare), out=squares)
    inverse = np.reciprocal(lengths, out=lengths)
    return [np.multiply(part, inverse, out=part) for part in directions]


def _cosines(vectors: Singles, directions: list[Singles]) -> Singles:
    """max(0, m . l) for vectors m (3, n), (L, n)."""
    cosines, spare = (buffer(name, *directions[0].shape) for name in ("cosines", "spare"))
    return np.maximum(dot(directions, vectors, cosines, spare), 0, out=cosines)
