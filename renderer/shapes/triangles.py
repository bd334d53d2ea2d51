"""Triangles, intersected by the watertight test of Woop, Benthin and Wald (2013)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.interaction import Points, Rays
from renderer.math.arrays import (
    Floats,
    Integers,
    Masks,
    cross,
    dot,
    lengths,
    magnitude,
    put,
    stacked,
    taken,
    unit,
)
from renderer.shapes import woop
from renderer.shapes.frames import derivatives_of_texture, frame_of_normals, frame_of_texture
from renderer.shapes.polygons import FlatFamily, Polygons
from schemas.reading.advice import CLEARLY_AN_AREA, on_one_line


@dataclass(slots=True, eq=False)
class Triangles(FlatFamily):
    """A family of triangles, one by one or in meshes; counter-clockwise vertices are seen from outside.

    Attributes
    ----------
    primitives : (K,) int64
        Number of each triangle within its shape.
    vertices : (3, 3, K) float64
        Vertex, coordinate, triangle.
    vertex_normals : (3, 3, K) float64
        Unit normals at the vertices, for smooth shading, on the whole on the outward side.
    smooth : (K,) bool
        Whether the vertex normals were given.
    retried : (K,) bool
        Whether exact arithmetic decided that it has an area.
    texture : (3, 2, K) float64
        Texture coordinates of the vertices; (0,0), (1,0), (0,1) unless given.
    mapped : (K,) bool
        Whether they were given.
    """

    primitives: Integers
    vertices: Floats
    vertex_normals: Floats
    smooth: Masks
    retried: Masks
    texture: Floats
    mapped: Masks

    def corners(self) -> Floats:
        """The vertices."""
        return self.vertices

    def edges(self) -> tuple[tuple[int, int], ...]:
        """The three sides."""
        return (0, 1), (1, 2), (2, 0)

    def intersect(self, shape: int, rays: Rays) -> None:
        """Hits with one triangle."""
        one = slice(shape, shape + 1)
        start = None
        if rays.origin_surfaces is not None:
            every = np.arange(rays.t.size)
            start = woop.start_of(
                rays.origin_surfaces, every, self.numbers[one], self.primitives[one], self.sizes[one]
            )
        found = woop.hits(self.vertices[:, :, one], rays.origins, rays.directions, start)
        rays.offer(found.pairs, found.t, (found.u, found.v), self.numbers[one], self.primitives[one])

    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Position and smooth normals as means of the vertices'."""
        weights = _weights(points, chosen)
        put(points.positions, chosen, _mean(self.vertices, shapes, weights))
        normals = taken(self.normals, shapes)
        flipped = dot(taken(points.directions, chosen), normals) > 0
        facing = points.face_rays(chosen, normals, flipped)
        if points.bent:
            smooth = unit(_mean(self.vertex_normals, shapes, weights)) * np.where(flipped, -1.0, 1.0)
            put(points.shading_normals, chosen, np.where(self.smooth[shapes], smooth, facing))

    def coordinates(self, points: Points, chosen: Integers, shapes: Integers) -> Floats:
        """Means of the vertices'."""
        return _mean(self.texture, shapes, _weights(points, chosen))

    def frames(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Direction in which u grows, or any frame if the texture coordinates define none."""
        del points, chosen
        normals = self.normals[:, shapes]
        vertices, texture = self.vertices[:, :, shapes], self.texture[:, :, shapes]
        tangents, handedness, valid = frame_of_texture(vertices, texture, normals)
        return np.where(valid, tangents, frame_of_normals(normals)), handedness

    def derivatives(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Solved from the texture coordinates of the vertices."""
        del points, chosen
        vertices, texture = self.vertices[:, :, shapes], self.texture[:, :, shapes]
        return derivatives_of_texture(vertices, texture)

    def smooth_shapes(self) -> Integers:
        """Triangles with vertex normals."""
        return np.unique(self.numbers[self.smooth])

    def without_area(self) -> Masks:
        """Degenerate triangles, whose normal is zero."""
        return np.asarray(magnitude(self.normals) == 0)

    def count_retried(self) -> int:
        """Number of the thin ones."""
        return int(np.count_nonzero(self.retried))

    def occluders(self) -> Polygons:
        """The same triangles as occluders."""
        following = self.vertices[[1, 2, 0]]
        inward = np.stack(
            [
                cross(self.normals, unit(end - start))
                for start, end in zip(self.vertices, following, strict=True)
            ]
        )
        return Polygons(
            numbers=self.numbers,
            primitives=self.primitives,
            sizes=self.sizes,
            normals=self.normals,
            anchors=self.vertices[0],
            edge_normals=inward,
            edge_anchors=self.vertices,
            corners=self.vertices,
        )


def _weights(points: Points, chosen: Integers) -> tuple[Floats, Floats, Floats]:
    """Barycentric weights of the three vertices at some points (m,)."""
    second, third = taken(points.hits[:2], chosen)
    return 1 - second - third, second, third


def _mean(values: Floats, shapes: Integers, weights: tuple[Floats, Floats, Floats]) -> Floats:
    return (
        taken(values[0], shapes) * weights[0]
        + taken(values[1], shapes) * weights[1]
        + taken(values[2], shapes) * weights[2]
    )


def unit_normals(vertices: Floats) -> Floats:
    """Outward unit normals (3, K) of triangles (3, 3, K), zero for those without area.

    The product of the two shortest edges: the angle between them is the widest, and the difference of
    vertices close to each other has all its digits. Error at most 8 eps over the sine of that angle.
    """
    a, b, c = vertices
    edges = np.stack((b - a, c - b, a - c))
    length = np.stack([lengths(edge) for edge in edges])
    longest = np.argmax(length, axis=0)
    first = np.take_along_axis(edges, ((longest + 1) % 3)[None, None], axis=0)[0]
    second = np.take_along_axis(edges, ((longest + 2) % 3)[None, None], axis=0)[0]
    return unit(cross(unit(first), unit(second)))


def needs_exact_area(vertices: Floats) -> Masks:
    """Triangles (K,) so thin that exact arithmetic has to decide whether they have an area."""
    a, b, c = vertices
    return lengths(cross(unit(b - a), unit(c - a))) <= CLEARLY_AN_AREA


def on_lines(shapes: Sequence[language.Triangle]) -> Masks:
    """Triangles (K,) of a scene whose vertices lie exactly on one line."""
    flat = needs_exact_area(stacked([shape.vertices for shape in shapes]))
    for number in np.flatnonzero(flat).tolist():
        flat[number] = on_one_line(*shapes[number].vertices)
    return flat


def build(numbers: Sequence[int], shapes: Sequence[language.Triangle], assets: AssetSource) -> Triangles:
    """The family of some triangles of a scene, given with their numbers."""
    del assets
    vertices = stacked([shape.vertices for shape in shapes])
    normals = unit_normals(vertices)
    corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    return Triangles(
        kind="triangle",
        numbers=np.array(numbers, dtype=np.int64),
        primitives=np.zeros(len(shapes), dtype=np.int64),
        sizes=np.max([magnitude(vertex) for vertex in vertices], axis=0),
        vertices=vertices,
        normals=normals,
        vertex_normals=_vertex_normals(shapes, normals),
        smooth=np.array([shape.normals is not None for shape in shapes]),
        retried=needs_exact_area(vertices),
        texture=stacked([shape.uvs or corners for shape in shapes]),
        mapped=np.array([shape.uvs is not None for shape in shapes]),
    )


def _vertex_normals(shapes: Sequence[language.Triangle], normals: Floats) -> Floats:
    """Unit normals (3, 3, K) at the vertices: those given, or the triangle's own.

    Both windings are in use, so the side is decided once for a triangle. Deciding it at each point would
    turn some of them over, with a jump where the smooth normal crosses the plane of the triangle.
    """
    given = np.stack((normals, normals, normals))
    smooth = [i for i, shape in enumerate(shapes) if shape.normals is not None]
    given[:, :, smooth] = stacked([shape.normals for shape in shapes if shape.normals is not None])
    at_vertices = np.stack([unit(corner) for corner in given])
    return at_vertices * np.where(dot(at_vertices.sum(axis=0), normals) < 0, -1.0, 1.0)
