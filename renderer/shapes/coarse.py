"""Displaced shapes that are not round, before they are cut: coarse triangles, whatever shapes they are of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetSource
from renderer.math.arrays import Floats, Integers, Masks, taken
from renderer.shapes import meshes, rectangles, triangles
from renderer.shapes.borders import corner_places


@dataclass(frozen=True, slots=True, eq=False)
class Coarse:
    """T triangles.

    Attributes
    ----------
    shapes : (T,) int64
        Number of the shape of each in the scene.
    corners, directions : (3, 3, T) float64
        Corner, coordinate, triangle; directions are the unit normals along which corners are moved.
    normals : (3, T) float64
        Unit.
    smooth : (T,) bool
        Whether they are shaded with `directions`, not with `normals`.
    texture : (3, 2, T) float64
    mapped : (T,) bool
        Whether the texture coordinates were given.
    """

    shapes: Integers
    corners: Floats
    directions: Floats
    normals: Floats
    smooth: Masks
    texture: Floats
    mapped: Masks

    def part(self, chosen: Integers) -> "Coarse":
        """Some of the triangles."""
        return Coarse(*(taken(getattr(self, item.name), chosen) for item in fields(self)))


def coarse_of(numbers: Sequence[int], shapes: Sequence[language.Shape], assets: AssetSource) -> Coarse:
    """The triangles of some shapes of a scene, one at least, given with their numbers, shape after shape.

    Raises
    ------
    AssetError
        As for `meshes.read`.
    TypeError
        If no line of this module makes triangles of a kind of shape.
    """
    parts = []
    known = tuple(kind for kinds, _ in _MADE_BY for kind in kinds)
    if unknown := [type(shape).__name__ for shape in shapes if not isinstance(shape, known)]:
        raise TypeError(f"{unknown[0]} cannot be displaced: no line of {__name__} makes triangles of it.")
    for kinds, make in _MADE_BY:
        chosen = [i for i, shape in enumerate(shapes) if isinstance(shape, kinds)]
        if chosen:
            parts.append(make([numbers[i] for i in chosen], [shapes[i] for i in chosen], assets))
    order = np.argsort(np.concatenate([part.shapes for part in parts]), kind="stable")
    rows = ([getattr(part, item.name) for part in parts] for item in fields(Coarse))
    return Coarse(*(taken(np.concatenate(row, axis=-1), order) for row in rows))


def _of_triangles(numbers: Sequence[int], shapes: Sequence[language.Triangle], assets: AssetSource) -> Coarse:
    """Moved along the normals that they state."""
    family = triangles.build(numbers, shapes, assets)
    made = _made(family.numbers, family.vertices, family.smooth, family.texture, family.mapped)
    return replace(made, directions=np.where(family.smooth, family.vertex_normals, made.directions))


def _of_rectangles(
    numbers: Sequence[int], shapes: Sequence[language.Rectangle | language.Parallelogram], assets: AssetSource
) -> Coarse:
    """Two triangles for each rectangle."""
    rows, texture = np.array([[0, 1], [1, 3], [2, 2]]), np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    family = rectangles.build(numbers, shapes, assets)
    corners = family.corners()[rows].transpose(0, 2, 3, 1).reshape(3, 3, -1)
    flat, mapped = np.zeros(2 * len(shapes), dtype=bool), np.ones(2 * len(shapes), dtype=bool)
    coordinates = np.tile(texture[rows].transpose(0, 2, 1), len(shapes))
    return _made(family.numbers.repeat(2), corners, flat, coordinates, mapped)


def _of_meshes(
    numbers: Sequence[int], shapes: Sequence[language.Mesh | language.MeshFile], assets: AssetSource
) -> Coarse:
    """Triangles of meshes in world coordinates."""
    surface = meshes.surface_of(list(meshes.read(numbers, shapes, assets)))
    owners, order = surface.meshes, meshes.winding(meshes.mirrored(shapes)[surface.meshes])
    corners = surface.corners(meshes.placed(surface, shapes))
    corners, texture = (
        np.take_along_axis(values, order, axis=0) for values in (corners, surface.corner_texture())
    )
    smooth = np.array([shape.smooth for shape in shapes])
    return _made(np.array(numbers)[owners], corners, smooth[owners], texture, surface.mapped[owners])


def _made(shapes: Integers, corners: Floats, smooth: Masks, texture: Floats, mapped: Masks) -> Coarse:
    """Triangles that are moved along the means of the normals of their shape's faces."""
    vertices, owner = corners.transpose(1, 0, 2).reshape(3, -1), corner_places(corners, shapes)
    rows = np.arange(owner.size).reshape(owner.shape)
    directions = meshes.smooth_normals(vertices, rows, owner.reshape(-1)).reshape(3, 3, -1)
    normals = triangles.unit_normals(corners)
    return Coarse(shapes, corners, directions.transpose(1, 0, 2), normals, smooth, texture, mapped)


_MADE_BY: Sequence[tuple[tuple[type[language.Shape], ...], Callable[..., Coarse]]] = (
    ((language.Triangle,), _of_triangles),
    ((language.Rectangle, language.Parallelogram), _of_rectangles),
    ((language.Mesh, language.MeshFile), _of_meshes),
)
