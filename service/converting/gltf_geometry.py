"""Geometry of a glTF document: its buffers and accessors, and the triangles of each material in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from renderer.math.arrays import Floats, Integers
from renderer.meshes.gltf import TRIANGLE_MODES
from renderer.meshes.gltf_containers import embedded, file_name, is_embedded
from renderer.meshes.gltf_geometry import COMPONENTS, WIDTHS, primitive_triangles, seen_from_outside
from service.converting.errors import FileAwayError, wrong_at
from service.converting.gltf_document import Accessor, Document, Image, Primitive, pick
from service.converting.gltf_nodes import PlacedNode
from service.converting.obj import SMOOTH_COSINE, cosines
from service.converting.task import Notes, Task

_ATTRIBUTES = {"POSITION", "NORMAL", "TEXCOORD_0", "TANGENT"}
_ENDINGS = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp"}


class Buffers:
    """The buffers, bufferViews and accessors of a document, as arrays.

    Parameters
    ----------
    task
        The file, from whose folder others are named.
    document
        Its description.
    binary
        The bytes after the description in a GLB; None in other files.
    """

    def __init__(self, task: Task, document: Document, binary: bytes | None) -> None:
        self.task = task
        self.document = document
        self.binary = binary
        self.name = task.notes.file
        self.read: dict[int, bytes] = {}

    def numbers(self, number: int, pointer: str, width: int) -> Floats:
        """Numbers of an accessor, (count, width) float64; normalised integers become 0 to 1, or -1 to 1.

        Raises
        ------
        ConversionError
            At the accessor, if it is invalid.
        """
        accessor = pick(self.name, self.document.accessors, number, pointer)
        place = f"/accessors/{number}"
        if accessor.sparse is not None or accessor.buffer_view is None:
            raise wrong_at(
                self.name, place, "Sparse accessors are not supported. Save the file without them."
            )
        if WIDTHS.get(accessor.type) != width or accessor.component_type not in COMPONENTS:
            detail = f"This must have {width} components, and a componentType of {sorted(COMPONENTS)}."
            raise wrong_at(self.name, place, detail)
        values = self._values(accessor, accessor.buffer_view, width, place).astype(np.float64)
        kind = np.dtype(COMPONENTS[accessor.component_type])
        if accessor.normalized and kind.kind in "iu":
            values = np.maximum(values / np.iinfo(kind).max, -1.0)
        if not np.isfinite(values).all():
            raise wrong_at(self.name, place, "Some of these numbers are not finite. Save the file again.")
        return values

    def _values(self, accessor: Accessor, view: int, width: int, place: str) -> np.ndarray:
        content = self.view(view, f"{place}/bufferView")
        kind = np.dtype(COMPONENTS[accessor.component_type])
        stride = self.document.buffer_views[view].byte_stride or kind.itemsize * width
        needed = accessor.byte_offset + (accessor.count - 1) * stride + kind.itemsize * width
        if accessor.count < 1 or needed > len(content) or stride < kind.itemsize * width:
            raise wrong_at(self.name, place, f"Its {accessor.count} items do not fit into its bufferView.")
        return np.ndarray(
            (accessor.count, width), kind, content, accessor.byte_offset, (stride, kind.itemsize)
        )

    def view(self, number: int, pointer: str) -> bytes:
        """Bytes of a bufferView; ConversionError if its buffer is shorter, or is not there."""
        view = pick(self.name, self.document.buffer_views, number, pointer)
        content = self._buffer(view.buffer, f"/bufferViews/{number}/buffer")
        if view.byte_offset + view.byte_length > len(content):
            detail = f"It ends beyond its buffer of {len(content)} bytes: the file is cut short, or damaged."
            raise wrong_at(self.name, f"/bufferViews/{number}", detail)
        return content[view.byte_offset : view.byte_offset + view.byte_length]

    def _buffer(self, number: int, pointer: str) -> bytes:
        buffer = pick(self.name, self.document.buffers, number, pointer)
        if number not in self.read:
            if buffer.uri is not None:
                try:
                    self.read[number] = self._uri(buffer.uri)
                except (FileAwayError, ValueError) as error:
                    raise wrong_at(self.name, f"/buffers/{number}/uri", str(error)) from error
            elif number == 0 and self.binary is not None:
                self.read[number] = self.binary
            else:
                detail = "The buffer has no 'uri', and this is not a GLB file, which would contain its bytes."
                raise wrong_at(self.name, f"/buffers/{number}", detail)
        return self.read[number]

    def _uri(self, uri: str) -> bytes:
        return (
            embedded(uri) if is_embedded(uri) else self.task.found.read(self.task.folder, file_name(uri))[1]
        )

    def picture(self, image: Image, number: int) -> tuple[str, str, bytes]:
        """Stem, ending and bytes of a picture.

        Raises
        ------
        ConversionError, FileAwayError, ValueError
            It is not there.
        """
        stem = image.name or f"picture-{number}"
        ending = _ENDINGS.get(image.mime_type or "", ".png")
        if image.buffer_view is not None:
            return stem, ending, self.view(image.buffer_view, f"/images/{number}/bufferView")
        if image.uri is None:
            raise ValueError("The picture has neither 'uri' nor 'bufferView'.")
        if is_embedded(image.uri):
            ending = _ENDINGS.get(image.uri[5:].partition(";")[0], ending)
            return stem, ending, self._uri(image.uri)
        path = PurePosixPath(file_name(image.uri))
        return path.stem, path.suffix, self._uri(image.uri)


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
        (V, 2), v upwards; None if there is none.
    bent
        Whether some normal in the file is not that of its triangle.
    """

    vertices: Floats
    triangles: Integers
    texture: Floats | None
    bent: bool


def parts_by_material(buffers: Buffers, nodes: Sequence[PlacedNode]) -> dict[int | None, list[Part]]:
    """Triangles of all nodes by material number, None for those without; anything but triangles is noted.

    Raises
    ------
    ConversionError
        At the invalid part of the document.
    """
    parts: dict[int | None, list[Part]] = {}
    for placed in nodes:
        if placed.node.mesh is not None:
            where = f"/nodes/{placed.number}/mesh"
            mesh = pick(buffers.name, buffers.document.meshes, placed.node.mesh, where)
            for number, primitive in enumerate(mesh.primitives):
                pointer = f"/meshes/{placed.node.mesh}/primitives/{number}"
                if _is_read(buffers.task.notes, primitive, pointer):
                    part = _part(buffers, placed, primitive, pointer)
                    parts.setdefault(primitive.material, []).append(part)
    return parts


def _is_read(notes: Notes, primitive: Primitive, pointer: str) -> bool:
    """Whether a primitive has triangles; what is not read of it is noted."""
    if primitive.mode not in TRIANGLE_MODES:
        notes.leave_out(f"{pointer}/mode", "Points and lines are left out.")
        return False
    for name in sorted(primitive.attributes.keys() - _ATTRIBUTES):
        detail = f"The attribute {name} is left out: scenes have no counterpart."
        notes.leave_out(f"{pointer}/attributes/{name}", detail)
    return True


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
    _note_tangents(buffers, primitive, positions[triangles], texture, triangles, pointer)
    bent = normals is not None and _bent(positions, normals, triangles)
    return Part(vertices, seen_from_outside(triangles, matrix[:3, :3]), texture, bent)


def _note_tangents(
    buffers: Buffers,
    primitive: Primitive,
    corners: Floats,
    texture: Floats | None,
    triangles: Integers,
    pointer: str,
) -> None:
    """Note tangents (T, 3 corners) that are not those of the texture coordinates, which the renderer uses."""
    tangents = _attribute(buffers, primitive, "TANGENT", 4, pointer)
    if tangents is None or texture is None:
        return
    own, (first, second) = tangents[triangles], _arms(corners)
    (u1, v1), (u2, v2) = (arm.T for arm in _arms(texture[triangles]))
    sign = np.sign(u1 * v2 - u2 * v1)
    along = (first * v2[:, None] - second * v1[:, None]) * sign[:, None]
    # Triangles without area in the picture have no direction of their own.
    turned = (np.einsum("tk,tck->tc", along, own[:, :, :3]) < 0) | (own[:, :, 3] * sign[:, None] < 0)
    if turned.any():
        detail = (
            "Tangents are left out: those of the texture coordinates are used, which here point elsewhere. "
            "A normal map looks raised where it should be sunken: export texture coordinates and tangents "
            "together."
        )
        buffers.task.notes.leave_out(f"{pointer}/attributes/TANGENT", detail)


def _arms(corners: Floats) -> tuple[Floats, Floats]:
    """From the first corner of each triangle to the others."""
    return corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]


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
    return primitive_triangles(order, primitive.mode)


def _bent(vertices: Floats, normals: Floats, triangles: Integers) -> bool:
    of_faces = np.cross(*_arms(vertices[triangles]))
    return any(
        bool((cosines(of_faces, normals[triangles[:, corner]]) < SMOOTH_COSINE).any()) for corner in range(3)
    )
