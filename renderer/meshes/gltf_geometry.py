"""Triangles of a glTF file, placed by its nodes.

Source: Khronos Group, glTF 2.0 specification, sections 3.5.3 (transformations) and 3.7.2 (meshes).
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats, Integers
from renderer.meshes.gltf import FAN, STRIP, TRIANGLE_MODES, Json, damage_reported
from renderer.meshes.gltf_containers import DAMAGED, split_glb
from renderer.meshes.triangulation import DEFAULT_COORDINATES
from schemas.quantities import MAX_COORDINATE

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Types of numbers, as NumPy writes them."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
"""Numbers of an item."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """A primitive in one place: vertices (V, 3), triangles (T, 3), texture coordinates (V, 2) or None."""

    vertices: Floats
    triangles: Integers
    texture: Floats | None


def read_glb(content: bytes) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V) or None of a packed GLB.

    Where some of its primitives have texture coordinates, triangles of the others get `DEFAULT_COORDINATES`.

    Raises
    ------
    AssetError
        It is damaged, or a primitive has numbers that cannot be used.
    """
    # Overflow is found at the vertices.
    with damage_reported(), np.errstate(over="ignore", invalid="ignore"):
        text, binary = split_glb(content)
        document = json.loads(text)
        parts = [*_parts(document, binary or b"")]
        if any(part.texture is not None for part in parts):
            parts = [_with_texture(part) for part in parts]
        counts = np.cumsum([0, *(len(part.vertices) for part in parts)])
        empty = np.empty((0, 3))
        vertices = np.concatenate([empty, *(part.vertices for part in parts)])
        triangles = np.concatenate(
            [
                empty.astype(np.int64),
                *(part.triangles + first for part, first in zip(parts, counts[:-1], strict=True)),
            ]
        )
        texture = [part.texture for part in parts if part.texture is not None]
        return vertices.T.copy(), triangles.T.copy(), np.concatenate(texture).T.copy() if texture else None


def _with_texture(part: _Part) -> _Part:
    if part.texture is not None:
        return part
    count = len(part.triangles)
    order = np.arange(3 * count).reshape(-1, 3)
    return _Part(part.vertices[part.triangles.ravel()], order, np.tile(DEFAULT_COORDINATES, (count, 1)))


def _parts(document: Json, binary: bytes) -> Iterator[_Part]:
    for node, world_from_node in _placed(document):
        if "mesh" in node:
            for number, primitive in enumerate(document["meshes"][node["mesh"]]["primitives"]):
                if primitive.get("mode", 4) in TRIANGLE_MODES:
                    name = f"Primitive {number} of mesh {node['mesh']}"
                    yield _part(document, binary, primitive, world_from_node, name)


def _placed(document: Json) -> Iterator[tuple[Json, Floats]]:
    """Nodes of the scene that is shown, parents before their children, with their places in the world."""
    seen: set[int] = set()
    waiting = [(number, np.eye(4)) for number in document["scenes"][document["scene"]].get("nodes", [])]
    while waiting:
        number, world_from_parent = waiting.pop(0)
        if number in seen:
            raise AssetError(DAMAGED)
        seen.add(number)
        node = document["nodes"][number]
        world_from_node = world_from_parent @ local_matrix(
            node.get("matrix"),
            node.get("translation", (0.0, 0.0, 0.0)),
            node.get("rotation", (0.0, 0.0, 0.0, 1.0)),
            node.get("scale", (1.0, 1.0, 1.0)),
        )
        yield node, world_from_node
        waiting = [(child, world_from_node) for child in node.get("children", [])] + waiting


def local_matrix(
    matrix: Sequence[float] | None,
    translation: Sequence[float],
    rotation: Sequence[float],
    scale: Sequence[float],
) -> Floats:
    """Takes columns (x, y, z, 1) from a node to its parent, (4, 4).

    Parameters
    ----------
    matrix
        Column by column, in place of the others.
    translation, scale
        Along x, y and z.
    rotation
        A quaternion x, y, z, w of any length but 0, which turns nothing.
    """
    if matrix is not None:
        return np.array(matrix, dtype=np.float64).reshape(4, 4).T
    local = np.eye(4)
    local[:3, :3] = _turn(np.array(rotation, dtype=np.float64)) * np.array(scale, dtype=np.float64)
    local[:3, 3] = translation
    return local


def _turn(quaternion: Floats) -> Floats:
    largest = np.abs(quaternion).max()
    if largest == 0:
        return np.eye(3)
    # Squares of very large or small numbers leave the range; a power of two rounds nothing.
    quaternion = np.ldexp(quaternion, -np.frexp(largest)[1])
    square = float(quaternion @ quaternion)
    x, y, z, w = quaternion / np.sqrt(square)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _part(document: Json, binary: bytes, primitive: Json, world_from_node: Floats, name: str) -> _Part:
    attributes = primitive["attributes"]
    positions = _numbers(document, binary, attributes["POSITION"], 3)
    turn, move = world_from_node[:3, :3], world_from_node[:3, 3]
    vertices = positions @ turn.T + move
    _refuse_out_of_range(name, "vertices", vertices)
    order = np.arange(len(positions))
    if "indices" in primitive:
        order = _numbers(document, binary, primitive["indices"], 1)[:, 0].astype(np.int64)
    if order.size and order.max() >= len(positions):
        raise AssetError(
            f"{name} names the vertex {order.max()}, which is not among its {len(positions)}: they count "
            "from 0. Save the mesh again."
        )
    triangles = seen_from_outside(primitive_triangles(order, primitive.get("mode", 4)), turn)
    texture = attributes.get("TEXCOORD_0")
    if texture is not None:
        texture = _coordinates(_numbers(document, binary, texture, 2), len(positions), name)
    return _Part(vertices, triangles, texture)


def _coordinates(texture: Floats, count: int, name: str) -> Floats:
    """Texture coordinates for a scene."""
    _refuse_out_of_range(name, "texture coordinates", texture)
    if len(texture) != count:
        raise AssetError(
            f"{name} has {len(texture)} pairs of texture coordinates for {count} vertices. Save the mesh "
            "again."
        )
    # v counts from the top of the picture in glTF, from the bottom in scenes.
    return np.stack([texture[:, 0], 1 - texture[:, 1]], axis=1)


def _numbers(document: Json, binary: bytes, number: int, width: int) -> Floats:
    """Numbers of an accessor, (count, width); those of normalised integers are shares of the largest."""
    accessor = document["accessors"][number]
    view, kind = (
        document["bufferViews"][accessor["bufferView"]],
        np.dtype(COMPONENTS[accessor["componentType"]]),
    )
    if WIDTHS[accessor["type"]] != width:
        raise AssetError(DAMAGED)
    stride = view.get("byteStride") or width * kind.itemsize
    start = view["byteOffset"] + accessor.get("byteOffset", 0)
    values = np.ndarray((accessor["count"], width), kind, binary, start, (stride, kind.itemsize))
    return values / (np.iinfo(kind).max if accessor.get("normalized", False) and kind.kind != "f" else 1.0)


def primitive_triangles(order: Integers, mode: int) -> Integers:
    """Triangles (T, 3) of a primitive.

    Parameters
    ----------
    order
        Its vertices in the order in which it names them, (N,). Those that make no whole triangle are ignored.
    mode
        One of `TRIANGLE_MODES`.
    """
    if mode == STRIP:
        triangles = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        # Every other triangle of a strip goes round the other way.
        triangles[1::2] = triangles[1::2, [1, 0, 2]]
        return triangles
    if mode == FAN:
        return np.stack([np.broadcast_to(order[:1], order[2:].shape), order[1:-1], order[2:]], axis=1)
    return order[: len(order) // 3 * 3].reshape(-1, 3)


def seen_from_outside(triangles: Integers, turn: Floats) -> Integers:
    """Triangles (T, 3) that keep their outside under a transformation (3, 3), which may mirror them."""
    return triangles[:, ::-1] if np.linalg.det(turn) < 0 else triangles


def _refuse_out_of_range(name: str, things: str, numbers: Floats) -> None:
    fine = np.abs(numbers) <= MAX_COORDINATE
    if not fine.all():
        row = int(np.argmin(fine.all(axis=1)))
        raise AssetError(
            f"{name} has {things} that are not finite, or larger than {MAX_COORDINATE:g}, first at its "
            f"vertex {row}, counted from 0. Save the mesh again."
        )
