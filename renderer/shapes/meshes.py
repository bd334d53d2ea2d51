"""Meshes: many triangles that share vertices, from the scene or from a file."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetError, AssetSource, limits_of
from renderer.math.arrays import Floats, Integers, Masks, column, cross, dot, lengths, magnitude, unit
from renderer.meshes.files import read_mesh
from renderer.meshes.triangulation import CORNERS
from renderer.shapes.triangles import Triangles, needs_exact_area, unit_normals
from schemas.limits import how_to_raise
from schemas.reading.advice import on_one_line


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One mesh.

    Attributes
    ----------
    vertices : (3, V) float64
    triangles : (3, T) int64
        Vertex numbers.
    texture : (2, V) float64 or None
    mapped : bool
        Whether the texture coordinates are those of the scene or the file.
    """

    vertices: Floats
    triangles: Integers
    texture: Floats | None
    mapped: bool


def surface_of(number: int, shape: language.Mesh | language.MeshFile, assets: AssetSource) -> Surface:
    """The mesh in its own coordinates.

    Raises
    ------
    AssetError
        If the file is missing, is no mesh, or has too many triangles; points to shape `number`.
    """
    if isinstance(shape, language.MeshFile):
        try:
            vertices, triangles, texture = read_mesh(shape.asset, assets)
        except AssetError as error:
            raise AssetError(str(error), f"/shapes/{number}/asset") from error
        return Surface(vertices, triangles, texture, texture is not None)
    return Surface(
        vertices=np.array(shape.vertices, dtype=np.float64).T.copy(),
        triangles=np.array(shape.triangles, dtype=np.int64).T.copy(),
        texture=None if shape.uvs is None else np.array(shape.uvs, dtype=np.float64).T.copy(),
        mapped=shape.uvs is not None,
    )


def placed(vertices: Floats, shape: language.Mesh | language.MeshFile) -> Floats:
    """Vertices (3, V) scaled, turned, and moved."""
    vertices = vertices * np.reshape(np.broadcast_to(shape.scale, 3), (3, 1))
    if shape.rotate is not None:
        vertices = _turned(vertices, unit(column(shape.rotate.axis)), np.radians(shape.rotate.degrees))
    return vertices + column(shape.translate)


def mirrored(shape: language.Mesh | language.MeshFile) -> bool:
    """Whether a mesh's scale turns its triangles over: counter-clockwise becomes clockwise."""
    return bool(np.prod(np.sign(shape.scale)) < 0)


def turned_over(family: Triangles) -> Triangles:
    """The same triangles with their other sides outside."""
    order = [0, 2, 1]
    return replace(
        family,
        vertices=family.vertices[order],
        normals=-family.normals,
        vertex_normals=-family.vertex_normals[order],
        texture=family.texture[order],
    )


def _turned(vectors: Floats, axis: Floats, angle: float) -> Floats:
    """Rodrigues' formula; the versine by the half angle, which keeps small turns exact."""
    versine = 2 * np.sin(angle / 2) ** 2
    across = cross(np.broadcast_to(axis, vectors.shape), vectors)
    return vectors + np.sin(angle) * across + versine * cross(np.broadcast_to(axis, vectors.shape), across)


def smooth_normals(vertices: Floats, triangles: Integers) -> Floats:
    """Unit normals (3, V) at vertices: the mean of their triangles' normals by angle.

    Vertices at the same place count as one, so that a seam in the texture is no seam in the shading. The
    angle makes the mean independent of how faces are cut into triangles (Thuermer and Wuethrich 1998).
    """
    owner = place_numbers(vertices)
    corners = [vertices[:, row] for row in triangles]
    normals = unit_normals(np.stack(corners))
    total = np.zeros((3, owner.max() + 1))
    for here in range(3):
        first, second = (unit(corners[(here + step) % 3] - corners[here]) for step in (1, 2))
        angle = np.arctan2(lengths(cross(first, second)), dot(first, second))
        for axis in range(3):
            np.add.at(total[axis], owner[triangles[here]], normals[axis] * angle)
    return unit(total)[:, owner]


def place_numbers(vertices: Floats) -> Integers:
    """Number of the place of each vertex (V,): equal for equal coordinates."""
    order = np.lexsort(vertices)
    ordered = vertices[:, order]
    fresh = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)
    places = np.zeros(order.size, dtype=np.int64)
    places[order[1:]] = np.cumsum(fresh)
    return places


def build(
    numbers: Sequence[int], shapes: Sequence[language.Mesh | language.MeshFile], assets: AssetSource
) -> Triangles:
    """The family of all triangles of some meshes of a scene, given with their numbers.

    Raises
    ------
    AssetError
        As for `surface_of`, or if the meshes have too many triangles together.
    """
    parts: list[Triangles] = []
    files: dict[str | None, Surface] = {}
    total, most = 0, limits_of(assets).max_mesh_triangles
    for number, shape in zip(numbers, shapes, strict=True):
        name = getattr(shape, "asset", None)
        surface = files.get(name) or surface_of(number, shape, assets)
        if name is not None:
            files[name] = surface
        total += surface.triangles.shape[1]
        _refuse_too_many(number, shape, total, most)
        part = triangles_of(number, placed(surface.vertices, shape), surface, smooth=shape.smooth)
        parts.append(turned_over(part) if mirrored(shape) else part)
    return joined(parts)


def _refuse_too_many(number: int, shape: language.Mesh | language.MeshFile, total: int, most: int) -> None:
    if total > most:
        place = "asset" if isinstance(shape, language.MeshFile) else "triangles"
        detail = (
            f"The meshes up to here have {total} triangles together, more than the {most} allowed. "
            f"{how_to_raise('max_mesh_triangles')}"
        )
        raise AssetError(detail, f"/shapes/{number}/{place}")


def triangles_of(number: int, vertices: Floats, surface: Surface, *, smooth: bool) -> Triangles:
    """The triangles of one mesh whose vertices have been placed.

    Those without area stay as points, so that primitive numbers are those of the file; nothing hits them.
    """
    rows = surface.triangles
    corners = np.stack([np.take(vertices, row, axis=1) for row in rows])
    thin = needs_exact_area(corners)
    # Off their line by a rounding they would be slivers that rays hit; no ray hits a point.
    corners = np.where(_without_area(corners, surface, thin), corners[0], corners)
    normals = unit_normals(corners)
    count = rows.shape[1]
    return Triangles(
        kind="mesh",
        numbers=np.full(count, number, dtype=np.int64),
        sizes=np.max([magnitude(vertex) for vertex in corners], axis=0),
        primitives=np.arange(count),
        vertices=corners,
        normals=normals,
        vertex_normals=_vertex_normals(vertices, rows, normals, smooth=smooth),
        smooth=np.full(count, smooth),
        retried=thin,
        texture=_texture(surface.texture, rows),
        mapped=np.full(count, surface.mapped),
    )


def _without_area(corners: Floats, surface: Surface, thin: Masks) -> Masks:
    """Triangles (T,), some of the thin ones, whose corners lie exactly on one line.

    Rounding alone would give them an area. Their own vertices may be on one line too: turned, they lie
    beside it by a rounding.
    """
    flat = thin.copy()
    for number in np.flatnonzero(flat).tolist():
        own = surface.vertices[:, surface.triangles[:, number]].T
        flat[number] = any(on_one_line(*three.tolist()) for three in (corners[:, :, number], own))
    return flat


def _vertex_normals(vertices: Floats, rows: Integers, normals: Floats, *, smooth: bool) -> Floats:
    """Normals (3, 3, T) at the corners; the triangle's own where those of a vertex cancel."""
    if not smooth:
        return np.broadcast_to(normals, (3, *normals.shape))
    at_vertices = smooth_normals(vertices, rows)
    corners = [at_vertices[:, row] for row in rows]
    return np.stack([np.where(corner.any(axis=0), corner, normals) for corner in corners])


def _texture(texture: Floats | None, rows: Integers) -> Floats:
    if texture is None:
        return np.broadcast_to(CORNERS[:, :, None], (3, 2, rows.shape[1]))
    return np.stack([texture[:, row] for row in rows])


def joined(parts: Sequence[Triangles]) -> Triangles:
    """One family of all triangles of several."""

    def join(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts], axis=-1)

    names = [item.name for item in fields(Triangles) if item.name != "kind"]
    return Triangles(kind=parts[0].kind, **{name: join(name) for name in names})
