"""Meshes in PLY files: polygons and triangle strips, with texture coordinates of vertices or of corners."""

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError
from renderer.math.arrays import Floats, Integers
from renderer.meshes.ply_header import header_of
from renderer.meshes.ply_rows import Body, Lists, Rows
from renderer.meshes.triangulation import DEFAULT_COORDINATES, triangulate
from schemas.quantities import MAX_COORDINATE

_AXES = ("x", "y", "z")
_PAIRS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
"""Names under which programs write the texture coordinates of vertices."""
_NUMBERS = ("vertex_indices", "vertex_index")
_OF_CORNERS = "texcoord"
_WANTED = {
    "vertex": frozenset({*_AXES, *(name for pair in _PAIRS for name in pair)}),
    "face": frozenset({*_NUMBERS, _OF_CORNERS}),
    "tristrips": frozenset(_NUMBERS),
}
_RESTART = -1
"""In a strip, between the end of one and the beginning of the next."""


def read_ply(content: bytes, most: int) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V) or None of a PLY file.

    Where a face has texture coordinates of its own at its corners, each corner of the mesh becomes a vertex.
    Where only some faces have any, triangles of the others get `DEFAULT_COORDINATES`.

    Parameters
    ----------
    content
        The whole file.
    most
        Most triangles that it may have.

    Raises
    ------
    AssetError
        It is damaged, has too many numbers, or a row that cannot be used; the message names it.
    """
    body = Body(content, header_of(content), most)
    found = body.read(_WANTED)
    if "vertex" not in found:
        raise AssetError("The mesh has no triangles: its header names no element 'vertex'. Save it again.")
    vertices = _vertices(body, found["vertex"])
    texture = _texture(body, found["vertex"])
    triangles, own = _faces(body, vertices, found.get("face"))
    strips = _strips(body, len(vertices), found.get("tristrips"))
    triangles = np.concatenate([triangles, strips])
    if own is None:
        return vertices.T.copy(), triangles.T.copy(), None if texture is None else texture.T.copy()
    # Coordinates of the corners count where a file has both.
    default = np.broadcast_to(DEFAULT_COORDINATES, (*triangles.shape, 2))
    shared = default if texture is None else texture[triangles]
    corners = shared.copy()
    corners[: len(own)] = np.where(np.isnan(own), corners[: len(own)], own)
    order = np.arange(triangles.size).reshape(triangles.shape)
    return vertices[triangles.ravel()].T.copy(), order.T.copy(), corners.reshape(-1, 2).T.copy()


def _vertices(body: Body, rows: Rows) -> Floats:
    missing = [name for name in _AXES if name not in rows.numbers]
    if missing:
        raise AssetError(f"The vertices of the mesh have no property {missing[0]!r}. Save it again.")
    return _columns(body, rows, _AXES)


def _texture(body: Body, rows: Rows) -> Floats | None:
    pair = next((pair for pair in _PAIRS if all(name in rows.numbers for name in pair)), None)
    return None if pair is None else _columns(body, rows, pair)


def _columns(body: Body, rows: Rows, names: tuple[str, ...]) -> Floats:
    """Some columns of the vertices, (V, N)."""
    columns = np.stack([rows.numbers[name] for name in names], axis=1).astype(np.float64)
    _refuse_out_of_range(body, "vertex", rows, np.abs(columns) <= MAX_COORDINATE, columns)
    return columns


def _refuse_out_of_range(
    body: Body, thing: str, rows: Rows, fine: NDArray[np.bool_], numbers: Floats
) -> None:
    if not fine.all():
        row, column = (int(place) for place in np.argwhere(~fine)[0])
        raise AssetError(
            f"{body.named(thing, row, rows.offsets[row])} of the mesh has the number "
            f"{numbers[row, column]:g}, which is not finite, or larger than {MAX_COORDINATE:g}. Correct it, "
            "or save the mesh again."
        )


def _faces(body: Body, vertices: Floats, rows: Rows | None) -> tuple[Integers, Floats | None]:
    """Triangles (T, 3), and their own texture coordinates (T, 3, 2), NaN where a face has none."""
    if rows is None:
        return np.empty((0, 3), dtype=np.int64), None
    lists = _numbers(rows, "face")
    numbers = _checked(body, "face", rows, lists, len(vertices), least=0)
    of_corners = rows.lists.get(_OF_CORNERS)
    if of_corners is None and (lists.sizes == 3).all():
        return numbers.reshape(-1, 3), None
    triangles, _ = triangulate(vertices[numbers], lists.sizes)
    if of_corners is None or not of_corners.sizes.any():
        return numbers[triangles], None
    texture = _of_corners(body, rows, lists.sizes, of_corners)
    return numbers[triangles], texture[triangles]


def _numbers(rows: Rows, thing: str) -> Lists:
    name = next((name for name in _NUMBERS if name in rows.lists), None)
    if name is None:
        raise AssetError(
            f"The element {thing!r} of the mesh has no list {_NUMBERS[0]!r}: which vertices its triangles "
            "have is not known. Save the mesh again."
        )
    return rows.lists[name]


def _checked(body: Body, thing: str, rows: Rows, lists: Lists, count: int, least: int) -> Integers:
    """All vertex numbers of some lists, which are whole and stand for a vertex."""
    odd = (lists.values < least) | (lists.values >= count)
    if lists.values.dtype.kind == "f":
        odd |= lists.values != np.trunc(lists.values)
    if odd.any():
        place = int(odd.argmax())
        row = int(np.searchsorted(np.cumsum(lists.sizes), place, side="right"))
        raise AssetError(
            f"{body.named(thing, row, rows.offsets[row])} of the mesh names the vertex "
            f"{lists.values[place]:g}, which is not among the {count}: they count from 0. Save the mesh "
            "again."
        )
    return lists.values.astype(np.int64)


def _of_corners(body: Body, rows: Rows, sizes: Integers, lists: Lists) -> Floats:
    """Texture coordinates of all corners, (C, 2), NaN for those of faces without."""
    wrong = (lists.sizes != 2 * sizes) & (lists.sizes != 0)
    if wrong.any():
        row = int(wrong.argmax())
        raise AssetError(
            f"{body.named('face', row, rows.offsets[row])} of the mesh has {sizes[row]} corners and "
            f"{lists.sizes[row]} numbers in {_OF_CORNERS!r}; each corner needs two. Save the mesh again."
        )
    values = lists.values.reshape(-1, 2).astype(np.float64)
    row_of = np.repeat(np.arange(len(sizes)), lists.sizes // 2)
    fine = np.abs(values) <= MAX_COORDINATE
    if not fine.all():
        place, column = (int(each) for each in np.argwhere(~fine)[0])
        row = int(row_of[place])
        raise AssetError(
            f"{body.named('face', row, rows.offsets[row])} of the mesh has the texture coordinate "
            f"{values[place, column]:g}. Correct it, or save the mesh again."
        )
    texture = np.full((int(sizes.sum()), 2), np.nan)
    texture[np.repeat(lists.sizes != 0, sizes)] = values
    return texture


def _strips(body: Body, count: int, rows: Rows | None) -> Integers:
    """Triangles (T, 3) of all strips; those that only join two parts have no area and are left out."""
    if rows is None or not len(rows.offsets):
        return np.empty((0, 3), dtype=np.int64)
    lists = _numbers(rows, "tristrips")
    numbers = _checked(body, "tristrips", rows, lists, count, least=_RESTART)
    numbers = np.insert(numbers, np.cumsum(lists.sizes), _RESTART)
    index = np.arange(len(numbers))
    begins = np.maximum.accumulate(np.where(numbers == _RESTART, index + 1, 0))
    triangles = np.stack([numbers[:-2], numbers[1:-1], numbers[2:]], axis=1)
    # Every other triangle of a strip goes round the other way.
    turned = (index[:-2] - begins[:-2]) % 2 == 1
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    a, b, c = triangles.T
    return triangles[(triangles != _RESTART).all(axis=1) & (a != b) & (b != c) & (c != a)]
