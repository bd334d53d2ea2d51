"""Triangles of a glTF scene, one mesh for each material, in the world's coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from renderer.math.arrays import Floats, Integers
from service.converting.errors import wrong_at
from service.converting.gltf_buffers import Buffers, pick
from service.converting.gltf_document import Primitive
from service.converting.gltf_nodes import PlacedNode
from service.converting.obj_parts import BENT, cosines

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(slots=True, eq=False)
class Part:
    """Triangles of one material.

    Attributes
    ----------
    vertices
        (V, 3) in scene units.
    triangles
        (T, 3) vertex numbers.
    texture
        (V, 2), v upwards; None where there is none.
    bent
        Whether some normal in the file is not that of its triangle.
    """

    vertices: Floats
    triangles: Integers
    texture: Floats | None
    bent: bool


@dataclass(slots=True)
class Parts:
    """Parts by material number; None for those without a material."""

    by_material: dict[int | None, list[Part]] = field(default_factory=dict)

    def add(self, buffers: Buffers, nodes: Sequence[PlacedNode]) -> None:
        """Add the triangles of all nodes; what is no triangle is noted.

        Raises
        ------
        ConversionError
            At the part of the document that makes no sense.
        """
        for placed in nodes:
            if placed.node.mesh is not None:
                where = f"/nodes/{placed.number}/mesh"
                mesh = pick(buffers.name, buffers.document.meshes, placed.node.mesh, where)
                for number, primitive in enumerate(mesh.primitives):
                    pointer = f"/meshes/{placed.node.mesh}/primitives/{number}"
                    self._add(buffers, placed, primitive, pointer)

    def _add(self, buffers: Buffers, placed: PlacedNode, primitive: Primitive, pointer: str) -> None:
        if primitive.mode not in {_TRIANGLES, _STRIP, _FAN}:
            buffers.task.notes.leave_out(f"{pointer}/mode", "Points and lines are left out.")
            return
        known = {"POSITION", "NORMAL", "TEXCOORD_0", "TANGENT"}
        for name in sorted(primitive.attributes.keys() - known):
            detail = f"The attribute {name} is left out: scenes have nothing like it."
            buffers.task.notes.leave_out(f"{pointer}/attributes/{name}", detail)
        part = _part(buffers, placed, primitive, pointer)
        self.by_material.setdefault(primitive.material, []).append(part)


def _part(buffers: Buffers, placed: PlacedNode, primitive: Primitive, pointer: str) -> Part:
    positions = _attribute(buffers, primitive, "POSITION", 3, pointer)
    if positions is None:
        raise wrong_at(buffers.name, f"{pointer}/attributes", "POSITION is missing: there are no vertices.")
    matrix = placed.world_from_node
    vertices = positions @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = _triangles(buffers, primitive, len(vertices), pointer)
    normals = _attribute(buffers, primitive, "NORMAL", 3, pointer)
    texture = _attribute(buffers, primitive, "TEXCOORD_0", 2, pointer)
    if texture is not None:
        # v counts from the top of the picture in glTF, from the bottom in scenes.
        texture = np.stack([texture[:, 0], 1 - texture[:, 1]], axis=1)
    bent = normals is not None and _bent(positions, normals, triangles)
    if np.linalg.det(matrix[:3, :3]) < 0:
        triangles = triangles[:, ::-1]
    return Part(vertices, triangles, texture, bent)


def _attribute(buffers: Buffers, primitive: Primitive, name: str, width: int, pointer: str) -> Floats | None:
    number = primitive.attributes.get(name)
    if number is None:
        return None
    values = buffers.numbers(number, f"{pointer}/attributes/{name}", width)
    count = buffers.document.accessors[primitive.attributes["POSITION"]].count
    if len(values) != count:
        detail = f"There are {len(values)} of them for {count} vertices. Give one for each vertex."
        raise wrong_at(buffers.name, f"{pointer}/attributes/{name}", detail)
    return values


def _triangles(buffers: Buffers, primitive: Primitive, count: int, pointer: str) -> Integers:
    if primitive.indices is None:
        order = np.arange(count)
    else:
        order = buffers.numbers(primitive.indices, f"{pointer}/indices", 1)[:, 0].astype(np.int64)
    if len(order) < 3 or order.min() < 0 or order.max() >= count:
        detail = f"Its triangles name vertices that are not among the {count}, or there is none."
        raise wrong_at(buffers.name, pointer, detail)
    if primitive.mode == _STRIP:
        strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        # Every other triangle of a strip goes round the other way.
        strip[1::2] = strip[1::2, [1, 0, 2]]
        return strip
    if primitive.mode == _FAN:
        return np.stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]], axis=1)
    return order[: len(order) // 3 * 3].reshape(-1, 3)


def _bent(vertices: Floats, normals: Floats, triangles: Integers) -> bool:
    first, second, third = (vertices[triangles[:, corner]] for corner in range(3))
    of_faces = np.cross(second - first, third - first)
    return any(bool((cosines(of_faces, normals[triangles[:, corner]]) < BENT).any()) for corner in range(3))
