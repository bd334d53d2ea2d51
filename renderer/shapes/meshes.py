"""Meshes: many triangles that share vertices, from the scene or from a file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

import schemas.shapes as language
from renderer.assets import AssetError, AssetSource, limits_of
from renderer.math.arrays import (
    Floats,
    Integers,
    Masks,
    columns,
    cross,
    dot,
    lengths,
    magnitude,
    put,
    taken,
    unit,
)
from renderer.math.streams import keys
from renderer.meshes.files import read_mesh
from renderer.meshes.triangulation import DEFAULT_COORDINATES
from renderer.shapes.triangles import Triangles, needs_exact_area, unit_normals
from schemas.limits import how_to_raise
from schemas.reading.advice import on_one_line

TRIANGLES_AT_ONCE = 1 << 14
"""Triangles of small meshes that are transformed at once: few NumPy calls, and arrays that stay in cache."""

Written = language.Mesh | language.MeshFile

Mesh = tuple[Floats, Integers, Floats | None]
"""Vertices (3, V), triangles (3, T) and texture coordinates (2, V) of one mesh, as `read_mesh` gives them."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Concatenated meshes.

    Attributes
    ----------
    vertices : (3, V) float64
    triangles : (3, T) int64
        Vertex numbers.
    texture : (2, V) float64
        Undefined if the scene or the file gives none.
    owners : (V,) int64
        Number of the mesh that has each vertex.
    mapped : (meshes,) bool
        Whether the texture coordinates are those of the scene or the file.
    """

    vertices: Floats
    triangles: Integers
    texture: Floats
    owners: Integers
    mapped: Masks

    @property
    def meshes(self) -> Integers:
        """Number of the mesh of each triangle, (T,), ascending."""
        return self.owners[self.triangles[0]]

    def corners(self, vertices: Floats) -> Floats:
        """Values (R, V) of the vertices at the corners of the triangles, (3, R, T)."""
        return np.stack([taken(vertices, row) for row in self.triangles])

    def corner_texture(self) -> Floats:
        """Texture coordinates (3, 2, T) of the corners, by default `DEFAULT_COORDINATES`."""
        given = self.corners(self.texture)
        return np.where(self.mapped[self.meshes], given, DEFAULT_COORDINATES[:, :, None])


def surface_of(meshes: Sequence[Mesh]) -> Surface:
    """Some meshes together."""
    vertices, triangles, textures = zip(*meshes, strict=True)
    counts = np.array([each.shape[1] for each in vertices])
    begins = (np.cumsum(counts) - counts).repeat([each.shape[1] for each in triangles])
    filled = [
        np.zeros((2, each.shape[1])) if uv is None else uv
        for each, uv in zip(vertices, textures, strict=True)
    ]
    return Surface(
        vertices=np.concatenate(vertices, axis=1),
        triangles=np.concatenate(triangles, axis=1) + begins,
        texture=np.concatenate(filled, axis=1),
        owners=np.arange(len(meshes)).repeat(counts),
        mapped=np.array([uv is not None for uv in textures]),
    )


def read(numbers: Sequence[int], shapes: Sequence[Written], assets: AssetSource) -> Iterator[Mesh]:
    """Each mesh in its own coordinates; of several from one file the file is read once.

    Raises
    ------
    AssetError
        If a file is missing, is not a mesh, or has too many triangles; points to the shape.
    """
    files: dict[str, Mesh] = {}
    for number, shape in zip(numbers, shapes, strict=True):
        if isinstance(shape, language.Mesh):
            yield _written(shape)
            continue
        if shape.asset not in files:
            files[shape.asset] = _from_file(number, shape.asset, assets)
        yield files[shape.asset]


def _written(shape: language.Mesh) -> Mesh:
    texture = None if shape.uvs is None else np.array(shape.uvs, dtype=np.float64).T
    return np.array(shape.vertices, dtype=np.float64).T, np.array(shape.triangles, dtype=np.int64).T, texture


def _from_file(number: int, name: str, assets: AssetSource) -> Mesh:
    try:
        return read_mesh(name, assets)
    except AssetError as error:
        raise AssetError(str(error), f"/shapes/{number}/asset") from error


def placed(surface: Surface, shapes: Sequence[Written]) -> Floats:
    """Vertices (3, V) scaled, turned, and moved, each as its mesh says."""
    owners = surface.owners
    vertices = surface.vertices * taken(columns([shape.scale for shape in shapes]), owners)
    turned = np.array([shape.rotate is not None for shape in shapes])
    if turned.any():
        chosen = np.flatnonzero(turned[owners])
        turns = [shape.rotate for shape in shapes if shape.rotate is not None]
        which = np.cumsum(turned)[owners[chosen]] - 1
        put(vertices, chosen, _turned(taken(vertices, chosen), turns, which))
    return vertices + taken(columns([shape.translate for shape in shapes]), owners)


def mirrored(shapes: Sequence[Written]) -> Masks:
    """Meshes (K,) whose scale turns their triangles over: counter-clockwise becomes clockwise."""
    return np.asarray(np.prod(np.sign([shape.scale for shape in shapes]), axis=1) < 0)


def winding(over: Masks) -> Integers:
    """Order (3, 1, K) of the corners of triangles, some of which are turned over."""
    return np.where(over, [[0], [2], [1]], [[0], [1], [2]])[:, None]


def _turned_over(family: Triangles, over: Masks) -> Triangles:
    """The same triangles, some of them (K,) with their other sides outside."""
    order, sign = winding(over), np.where(over, -1.0, 1.0)
    return replace(
        family,
        vertices=np.take_along_axis(family.vertices, order, axis=0),
        normals=family.normals * sign,
        vertex_normals=np.take_along_axis(family.vertex_normals, order, axis=0) * sign,
        texture=np.take_along_axis(family.texture, order, axis=0),
    )


def _turned(vectors: Floats, turns: Sequence[language.Turn], which: Integers) -> Floats:
    """Vectors (3, N), each by the turn of its number (N,).

    Rodrigues' formula; the versine by the half angle, which keeps small turns exact.
    """
    axes = taken(unit(columns([turn.axis for turn in turns])), which)
    angles = np.radians([turn.degrees for turn in turns])
    # Squares of Python floats, which round unlike those of arrays, so that pictures keep their bytes.
    versines = 2 * np.array([sine**2 for sine in np.sin(angles / 2).tolist()])
    across = cross(axes, vectors)
    return vectors + np.sin(angles)[which] * across + versines[which] * cross(axes, across)


def smooth_normals(vertices: Floats, triangles: Integers, owner: Integers) -> Floats:
    """Unit normals (3, V) at vertices: the mean of their triangles' normals by angle.

    Vertices at the same place, of which `owner` (V,) is the number, count as one, so that a seam in the
    texture is no seam in the shading. The angle makes the mean independent of how faces are cut into
    triangles (Thuermer and Wuethrich 1998).
    """
    corners = [taken(vertices, row) for row in triangles]
    normals = unit_normals(np.stack(corners))
    total = np.zeros((3, owner.max() + 1))
    for here in range(3):
        first, second = (unit(corners[(here + step) % 3] - corners[here]) for step in (1, 2))
        angle = np.arctan2(lengths(cross(first, second)), dot(first, second))
        for axis in range(3):
            np.add.at(total[axis], owner[triangles[here]], normals[axis] * angle)
    return taken(unit(total), owner)


def place_numbers(vertices: Floats, owners: Integers) -> Integers:
    """Number of the place of each vertex (V,): equal for equal coordinates of one owner (V,)."""
    order = np.lexsort((*vertices, owners))
    ordered, owned = taken(vertices, order), owners[order]
    fresh = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0) | (owned[1:] != owned[:-1])
    owners = np.zeros(order.size, dtype=np.int64)
    owners[order[1:]] = np.cumsum(fresh)
    return owners


def build(numbers: Sequence[int], shapes: Sequence[Written], assets: AssetSource) -> Triangles:
    """The family of all triangles of some meshes of a scene, given with their numbers.

    Raises
    ------
    AssetError
        As for `read`, or if the meshes have too many triangles together.
    """
    parts: list[Triangles] = []
    begin = 0
    for meshes in _portions(_not_too_many(numbers, shapes, assets)):
        chosen = slice(begin, begin := begin + len(meshes))
        parts.append(_family(np.array(numbers[chosen]), shapes[chosen], surface_of(meshes)))
    return joined(parts)


def _not_too_many(numbers: Sequence[int], shapes: Sequence[Written], assets: AssetSource) -> Iterator[Mesh]:
    """Yield each mesh, and raise as soon as there are too many triangles."""
    total, most = 0, limits_of(assets).max_mesh_triangles
    for number, shape, mesh in zip(numbers, shapes, read(numbers, shapes, assets), strict=True):
        total += mesh[1].shape[1]
        if total > most:
            place = "asset" if isinstance(shape, language.MeshFile) else "triangles"
            detail = (
                f"The meshes up to here have {total} triangles together, more than the {most} allowed. "
                f"{how_to_raise('max_mesh_triangles')}"
            )
            raise AssetError(detail, f"/shapes/{number}/{place}")
        yield mesh


def _portions(meshes: Iterator[Mesh]) -> Iterator[list[Mesh]]:
    waiting: list[Mesh] = []
    count = 0
    for mesh in meshes:
        waiting.append(mesh)
        count += mesh[1].shape[1]
        if count >= TRIANGLES_AT_ONCE:
            yield waiting
            waiting, count = [], 0
    if waiting:
        yield waiting


def _family(numbers: Integers, shapes: Sequence[Written], surface: Surface) -> Triangles:
    smooth = np.array([shape.smooth for shape in shapes])
    family = triangles_of(numbers, placed(surface, shapes), surface, smooth=smooth)
    over = mirrored(shapes)
    return _turned_over(family, over[surface.meshes]) if over.any() else family


def triangles_of(numbers: Integers, vertices: Floats, surface: Surface, *, smooth: Masks) -> Triangles:
    """The triangles of meshes whose vertices have been placed: of each the shape's number and its shading.

    Those without area become points, so that primitive numbers are those of the file; nothing hits them. So
    do copies of an earlier one of their mesh, which rays would hit first: thousands of copies at one place
    would cost as many tests per ray.
    """
    meshes, corners = surface.meshes, surface.corners(vertices)
    thin = needs_exact_area(corners)
    # A rounding could turn them into slivers that rays hit; no ray hits a point.
    corners = np.where(_without_area(corners, surface, thin) | _copies(corners, meshes), corners[0], corners)
    normals = unit_normals(corners)
    return Triangles(
        kind="mesh",
        numbers=numbers[meshes],
        sizes=np.max([magnitude(vertex) for vertex in corners], axis=0),
        primitives=np.arange(meshes.size) - np.searchsorted(meshes, meshes),
        vertices=corners,
        normals=normals,
        vertex_normals=_vertex_normals(vertices, surface, normals, smooth[meshes]),
        smooth=smooth[meshes],
        retried=thin,
        texture=surface.corner_texture(),
        mapped=surface.mapped[meshes],
    )


def _without_area(corners: Floats, surface: Surface, thin: Masks) -> Masks:
    """Triangles (T,), some of the thin ones, whose corners lie exactly on one line.

    Rounding alone would give them an area: vertices on one line are off it by a rounding after a rotation.
    """
    flat = thin.copy()
    for number in np.flatnonzero(flat).tolist():
        own = surface.vertices[:, surface.triangles[:, number]].T
        flat[number] = any(on_one_line(*three.tolist()) for three in (corners[:, :, number], own))
    return flat


def _copies(corners: Floats, meshes: Integers) -> Masks:
    """Triangles (T,) with the corners of an earlier one of their mesh, in the same order."""
    bits = corners.reshape(9, -1).view(np.uint64)
    # Hash collisions may only hide a copy.
    order = np.argsort(keys(0, *bits), kind="stable")
    bits, meshes = bits[:, order], meshes[order]
    found = np.zeros(order.size, dtype=bool)
    found[order[1:]] = (bits[:, 1:] == bits[:, :-1]).all(axis=0) & (meshes[1:] == meshes[:-1])
    return found


def _vertex_normals(vertices: Floats, surface: Surface, normals: Floats, smooth: Masks) -> Floats:
    """Normals (3, 3, T) at the corners; the triangle's own where it is flat, or those of a vertex cancel."""
    own = np.broadcast_to(normals, (3, *normals.shape))
    chosen = np.flatnonzero(smooth)
    if not chosen.size:
        return own
    rows, result = taken(surface.triangles, chosen), own.copy()
    at_vertices = smooth_normals(vertices, rows, place_numbers(vertices, surface.owners))
    for corner, row in zip(result, rows, strict=True):
        given = taken(at_vertices, row)
        put(corner, chosen, np.where(given.any(axis=0), given, taken(normals, chosen)))
    return result


def joined(parts: Sequence[Triangles]) -> Triangles:
    """One family of all triangles of several, those of a shape together, in the order of the scene."""
    numbers = np.concatenate([part.numbers for part in parts])
    order = None if (np.diff(numbers) >= 0).all() else np.argsort(numbers, kind="stable")

    def join(name: str) -> np.ndarray:
        values = np.concatenate([getattr(part, name) for part in parts], axis=-1)
        return values if order is None else taken(values, order)

    names = [item.name for item in fields(Triangles) if item.name != "kind"]
    return Triangles(kind=parts[0].kind, **{name: join(name) for name in names})
