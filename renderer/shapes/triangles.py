"""Triangles, met by the watertight test of Woop, Benthin and Wald (2013)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import schemas.shapes as language
from renderer.arrays import Floats, Integers, Masks, cross, dot, lengths, magnitude, unit
from renderer.interaction import Points, Rays
from renderer.numerics import gamma
from renderer.shapes.family import Family
from renderer.shapes.frames import frame_of_normals, frame_of_texture
from renderer.shapes.polygons import Polygons


@dataclass(slots=True)
class Triangles(Family):
    """A family of triangles.

    Attributes
    ----------
    vertices : (3, 3, K) float64
        Vertex, coordinate, triangle.
    normals : (3, K) float64
        Outward unit normals: counter-clockwise vertices seen from outside.
    vertex_normals : (3, 3, K) float64
        Unit normals at the vertices, for smooth shading.
    smooth : (K,) bool
        Whether the vertex normals were given.
    texture : (3, 2, K) float64
        Texture coordinates of the vertices; (0,0), (1,0), (0,1) unless given.
    """

    kind: ClassVar[str] = "triangle"

    vertices: Floats
    normals: Floats
    vertex_normals: Floats
    smooth: Masks
    texture: Floats

    def corners(self) -> Floats:
        """The vertices."""
        return self.vertices

    def meet(self, shape: int, rays: Rays) -> None:
        """Hits with one triangle, the rays sorted by the axis that they follow most."""
        leading = np.argmax(np.abs(rays.directions), axis=0)
        for axis in range(3):
            chosen = np.flatnonzero(leading == axis)
            if chosen.size:
                self._meet_along(axis, shape, rays, chosen)

    def _meet_along(self, axis: int, shape: int, rays: Rays, chosen: Integers) -> None:
        """Edge functions in a frame sheared so that the ray is its axis.

        Each vertex is sheared once and alike for all triangles that share it, and x1 * y2 - y1 * x2 only
        changes its sign when the vertices trade places: no ray slips between neighbours.
        """
        x_axis, y_axis = (axis + 1) % 3, (axis + 2) % 3
        direction, origin = rays.directions[:, chosen], rays.origins_at(chosen)
        shear_x, shear_y = direction[x_axis] / direction[axis], direction[y_axis] / direction[axis]
        x, y, z = [], [], []
        for vertex in self.vertices[:, :, shape]:
            depth = vertex[axis] - origin[axis]
            x.append((vertex[x_axis] - origin[x_axis]) - shear_x * depth)
            y.append((vertex[y_axis] - origin[y_axis]) - shear_y * depth)
            z.append(depth)
        weights = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
        least = np.minimum(np.minimum(weights[0], weights[1]), weights[2])
        greatest = np.maximum(np.maximum(weights[0], weights[1]), weights[2])
        found = np.flatnonzero(((least >= 0) & (greatest > 0)) | ((greatest <= 0) & (least < 0)))
        if not found.size:
            return
        a, b, c = (weight[found] for weight in weights)
        sheared = [np.stack((px[found], py[found])) for px, py in zip(x, y, strict=True)]
        depths = [np.broadcast_to(depth, chosen.shape)[found] for depth in z]
        total = a + b + c
        height = a * depths[0] + b * depths[1] + c * depths[2]
        distance = height / total / direction[axis][found]
        ahead = (distance > 0) & (np.abs(height) > _rounding(sheared, depths))
        self._offer(shape, rays, chosen[found], distance, (b / total, c / total), ahead)

    def _offer(
        self,
        shape: int,
        rays: Rays,
        hit: Integers,
        distance: Floats,
        weights: tuple[Floats, Floats],
        ahead: Masks,
    ) -> None:
        rays.offer(
            int(self.numbers[shape]), hit[ahead], distance[ahead], weights[0][ahead], weights[1][ahead]
        )

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Position, normals and texture coordinates as means of the vertices'."""
        second, third = points.hits[:, chosen]
        first = 1 - second - third
        weights = (first, second, third)
        points.positions[:, chosen] = _mean(self.vertices, shapes, weights)
        points.coordinates[:, chosen] = _mean(self.texture, shapes, weights)
        normals = self.normals[:, shapes]
        flipped = dot(points.directions[:, chosen], normals) > 0
        facing = normals * np.where(flipped, -1.0, 1.0)
        points.flipped[chosen] = flipped
        points.normals[:, chosen] = points.shading_normals[:, chosen] = facing
        if points.bent:
            bent = unit(_mean(self.vertex_normals, shapes, weights))
            bent *= np.where(dot(bent, facing) < 0, -1.0, 1.0)
            points.shading_normals[:, chosen] = np.where(self.smooth[shapes], bent, facing)

    def frame(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Directions in which the texture coordinates grow, or any frame where they do not say."""
        del points, chosen
        normals = self.normals[:, shapes]
        vertices, texture = self.vertices[:, :, shapes], self.texture[:, :, shapes]
        tangents, valid = frame_of_texture(vertices, texture, normals)
        tangents = np.where(valid, tangents, frame_of_normals(normals))
        return tangents, cross(normals, tangents)

    def occluders(self) -> Polygons:
        """The same triangles as things that stand in the light."""
        following = self.vertices[[1, 2, 0]]
        inward = np.stack(
            [
                cross(self.normals, unit(end - start))
                for start, end in zip(self.vertices, following, strict=True)
            ]
        )
        return Polygons(
            numbers=self.numbers,
            sizes=self.sizes,
            normals=self.normals,
            anchors=self.vertices[0],
            edge_normals=inward,
            edge_anchors=self.vertices,
            corners=self.vertices,
        )


def _rounding(sheared: list[Floats], depths: list[Floats]) -> Floats:
    """Bound on the rounding of the weighted sum of depths: closer than this, a start is on the triangle."""
    a, b, c = (np.abs(xy) for xy in sheared)
    terms = (
        (c[0] * b[1] + c[1] * b[0]) * np.abs(depths[0])
        + (a[0] * c[1] + a[1] * c[0]) * np.abs(depths[1])
        + (b[0] * a[1] + b[1] * a[0]) * np.abs(depths[2])
    )
    return gamma(16) * terms


def _mean(values: Floats, shapes: Integers, weights: tuple[Floats, Floats, Floats]) -> Floats:
    return (
        values[0][:, shapes] * weights[0]
        + values[1][:, shapes] * weights[1]
        + values[2][:, shapes] * weights[2]
    )


def unit_normals(vertices: Floats) -> Floats:
    """Outward unit normals (3, K) of triangles (3, 3, K), zero for those without area.

    The product of the two longest edges: with the short one of a needle the error would be its
    relative error, which is large.
    """
    a, b, c = vertices
    edges = np.stack((b - a, c - b, a - c))
    length = np.stack([lengths(edge) for edge in edges])
    shortest = np.argmin(length, axis=0)
    first = np.take_along_axis(edges, ((shortest + 1) % 3)[None, None], axis=0)[0]
    second = np.take_along_axis(edges, ((shortest + 2) % 3)[None, None], axis=0)[0]
    return unit(cross(unit(first), unit(second)))


def build(numbers: Sequence[int], shapes: Sequence[language.Triangle]) -> Triangles:
    """The family of some triangles of a scene, given with their numbers."""
    vertices = np.array([shape.vertices for shape in shapes], dtype=np.float64).transpose(1, 2, 0).copy()
    normals = unit_normals(vertices)
    given = [shape.normals for shape in shapes]
    corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    flat = normals.T[:, None, :].repeat(3, axis=1)
    bent = [
        flat[i] if normal is None else np.array(normal, dtype=np.float64) for i, normal in enumerate(given)
    ]
    vertex_normals = np.array(bent).transpose(1, 2, 0)
    texture = [corners if shape.uvs is None else shape.uvs for shape in shapes]
    return Triangles(
        numbers=np.array(numbers, dtype=np.int64),
        sizes=np.max([magnitude(vertex) for vertex in vertices], axis=0),
        vertices=vertices,
        normals=normals,
        vertex_normals=np.stack([unit(normal) for normal in vertex_normals]),
        smooth=np.array([normal is not None for normal in given]),
        texture=np.array(texture, dtype=np.float64).transpose(1, 2, 0).copy(),
    )
