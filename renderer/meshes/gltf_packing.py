"""A glTF file with its buffers as one GLB of geometry alone: no materials, pictures, animations.

The bytes made are a function of the bytes read, so that equal meshes have equal names on a server.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from renderer.assets import AssetError
from renderer.meshes.gltf import ATTRIBUTES, GltfFile, Json, damage_reported, used_accessors
from renderer.meshes.gltf_containers import embedded, file_name, is_embedded, join_glb
from renderer.meshes.gltf_geometry import COMPONENTS, WIDTHS

ReadFile = Callable[[str], bytes]
"""Gives the content of a file that is named relative to the mesh; AssetError if it cannot be read."""

_NODE = ("children", "matrix", "mesh", "rotation", "scale", "translation")
_ACCESSOR = ("byteOffset", "componentType", "count", "normalized", "type")


def packed(file: GltfFile, read: ReadFile) -> bytes:
    """A GLB with the nodes, meshes and numbers of a file.

    Raises
    ------
    AssetError
        If a buffer cannot be read, or is shorter than what is to be in it.
    """
    with damage_reported():
        document, used = file.document, used_accessors(file.document)
        numbers = {old: new for new, old in enumerate(used)}
        gathered = _Gathered(file, read)
        kept: Json = {"asset": {"version": "2.0"}, "scene": document.get("scene", 0)}
        scenes = [_picked(each, ("nodes",)) for each in document.get("scenes", [])]
        # A document without scenes is shown with all its nodes, as `penumbra convert` shows it.
        kept["scenes"] = scenes or [{"nodes": _roots(document)}]
        kept["nodes"] = [_picked(node, _NODE) for node in document.get("nodes", [])]
        kept["meshes"] = [
            {"primitives": [_primitive(part, numbers) for part in mesh["primitives"]]}
            for mesh in document["meshes"]
        ]
        kept["accessors"] = [gathered.accessor(document["accessors"][old], old) for old in used]
        kept["bufferViews"] = gathered.views
        kept["buffers"] = [{"byteLength": len(gathered.binary)}]
        kept["materials"] = [{}]
        return join_glb(json.dumps(kept, separators=(",", ":")).encode(), bytes(gathered.binary))


def _roots(document: Json) -> list[int]:
    nodes = document.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    return [number for number in range(len(nodes)) if number not in children]


def _picked(thing: Json, names: Sequence[str]) -> Json:
    return {name: thing[name] for name in names if name in thing}


def _primitive(primitive: Json, numbers: dict[int, int]) -> Json:
    attributes = {
        name: numbers[primitive["attributes"][name]] for name in ATTRIBUTES if name in primitive["attributes"]
    }
    indices = {"indices": numbers[primitive["indices"]]} if "indices" in primitive else {}
    # Texture coordinates are read for primitives with a material only.
    return _picked(primitive, ("mode",)) | indices | {"attributes": attributes, "material": 0}


@dataclass(slots=True)
class _Gathered:
    """Collects the parts of buffers that are in use, each once, into one buffer."""

    file: GltfFile
    read: ReadFile
    binary: bytearray = field(default_factory=bytearray)
    views: list[Json] = field(default_factory=list)
    _numbers: dict[int, int] = field(default_factory=dict)
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def accessor(self, accessor: Json, number: int) -> Json:
        """The accessor, with its part of a buffer in the new buffer."""
        old = accessor["bufferView"]
        length = self.file.document["bufferViews"][old]["byteLength"]
        stride = self.file.document["bufferViews"][old].get("byteStride")
        if _end(accessor, stride) > length:
            raise AssetError(
                f"The {accessor['count']} items of accessor {number} do not fit into its bufferView of "
                f"{length} bytes: the mesh is damaged. Save it again."
            )
        return {"bufferView": self._view(old)} | _picked(accessor, _ACCESSOR)

    def _view(self, old: int) -> int:
        if old not in self._numbers:
            view = self.file.document["bufferViews"][old]
            start, length = view.get("byteOffset", 0), view["byteLength"]
            buffer = self._buffer(view["buffer"])
            if start < 0 or length < 0 or start + length > len(buffer):
                raise AssetError(
                    f"The bufferView {old} ends beyond its buffer of {len(buffer)} bytes: the mesh is "
                    "damaged. Save it again."
                )
            self._numbers[old] = len(self.views)
            # Components of 4 bytes must begin at multiples of 4.
            self.binary += b"\0" * (-len(self.binary) % 4)
            place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": length}
            self.views.append(place | _picked(view, ("byteStride",)))
            self.binary += buffer[start : start + length]
        return self._numbers[old]

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            buffer = self.file.document["buffers"][number]
            content = self._content(buffer, number)
            if len(content) < buffer["byteLength"]:
                raise AssetError(
                    f"Buffer {number} of the mesh has {len(content)} bytes, where its byteLength says "
                    f"{buffer['byteLength']}: it is cut short. Save the mesh again with its buffers."
                )
            self._buffers[number] = content[: buffer["byteLength"]]
        return self._buffers[number]

    def _content(self, buffer: dict[str, Any], number: int) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            if self.file.binary is None or number:
                raise AssetError(f"Buffer {number} of the mesh has no 'uri'. Save it again, or as GLB.")
            return self.file.binary
        if is_embedded(uri):
            return embedded(uri)
        return self.read(file_name(uri))


def _end(accessor: Json, stride: int | None) -> int:
    """End of an accessor's last item in its bufferView, bytes."""
    item = np.dtype(COMPONENTS[accessor["componentType"]]).itemsize * WIDTHS[accessor["type"]]
    if accessor["count"] == 0:
        return 0
    return int(accessor.get("byteOffset", 0) + (accessor["count"] - 1) * (stride or item) + item)
