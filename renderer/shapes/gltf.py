"""What a binary glTF file announces, and the file without all that is not geometry.

Only the description at its beginning is read here. It is small, and it says what the file would unpack to.
"""

import json
import struct
from typing import Any

from renderer.assets import AssetError
from schemas.limits import how_to_raise

_DAMAGED = "The mesh cannot be read as GLB: it is damaged."
_HEADER = struct.Struct("<4sIIII")
_JSON = 0x4E4F534A
_LONGEST = 8 * 1024 * 1024
"""Bytes of a description; parsed it takes some twenty times as much."""
PARTS = 2000
"""Parts that a mesh may have in any case, however few triangles it may have."""
_TRIANGLES, _STRIP = 4, 5
_NODE = ("children", "matrix", "mesh", "rotation", "scale", "translation")
_ACCESSOR = ("bufferView", "byteOffset", "componentType", "count", "normalized", "type")
_VIEW = ("buffer", "byteLength", "byteOffset", "byteStride")


def triangle_count(content: bytes, most: int) -> int:
    """Triangles of all nodes of a file, as it announces them.

    Raises
    ------
    AssetError
        If the description is damaged, names other files, or uses a node in more than one place.
    """
    return _checked(content, most)[1]


def geometry_alone(content: bytes, most: int) -> bytes:
    """The same file without materials, pictures, animations and extensions.

    Raises
    ------
    AssetError
        As for `triangle_count`.
    """
    document, _ = _checked(content, most)
    kept: dict[str, Any] = {name: document[name] for name in ("asset", "scene", "scenes") if name in document}
    kept["nodes"] = [_picked(node, _NODE) for node in document.get("nodes", [])]
    kept["meshes"] = [
        {"primitives": [_primitive(part) for part in mesh["primitives"]]} for mesh in document["meshes"]
    ]
    kept["accessors"] = [_picked(accessor, _ACCESSOR) for accessor in document["accessors"]]
    kept["bufferViews"] = [_picked(view, _VIEW) for view in document["bufferViews"]]
    kept["buffers"] = [_picked(buffer, ("byteLength",)) for buffer in document["buffers"]]
    kept["materials"] = [{}]
    text = json.dumps(kept).encode()
    text += b" " * (-len(text) % 4)
    length = struct.unpack_from("<I", content, 12)[0]
    rest = content[_HEADER.size + length :]
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(text) + len(rest), len(text), _JSON) + text + rest


def _picked(thing: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: thing[name] for name in names if name in thing}


def _primitive(primitive: dict[str, Any]) -> dict[str, Any]:
    attributes = _picked(primitive["attributes"], ("POSITION", "TEXCOORD_0"))
    # Texture coordinates are read for primitives with a material only.
    return _picked(primitive, ("indices", "mode")) | {"attributes": attributes, "material": 0}


def _checked(content: bytes, most: int) -> tuple[dict[str, Any], int]:
    try:
        document = _document(content)
        _refuse_other_files(document)
        _refuse_large_accessors(document["accessors"], most)
        return document, _count(document)
    except (
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        ValueError,
        OverflowError,
        RecursionError,
        struct.error,
    ) as error:
        if isinstance(error, AssetError):
            raise
        raise AssetError(_DAMAGED) from error


def _document(content: bytes) -> dict[str, Any]:
    magic, version, _, length, kind = _HEADER.unpack_from(content)
    if (magic, version, kind) != (b"glTF", 2, _JSON):
        raise AssetError(_DAMAGED)
    if length > _LONGEST:
        raise AssetError(
            f"The description of the mesh has {length} bytes; at most {_LONGEST} are read. Split the mesh."
        )
    document = json.loads(content[_HEADER.size : _HEADER.size + length])
    if not isinstance(document, dict):
        raise AssetError(_DAMAGED)
    return document


def _refuse_other_files(document: dict[str, Any]) -> None:
    if any("uri" in buffer for buffer in document["buffers"]):
        raise AssetError("The mesh names other files. Save it as one binary glTF file (GLB).")


def _refuse_large_accessors(accessors: list[dict[str, Any]], most: int) -> None:
    """A few bytes may stand for any number of vertices, all zero or all the same."""
    if any("bufferView" not in accessor for accessor in accessors):
        raise AssetError("The mesh is compressed or sparse. Save it as plain GLB.")
    counts = [int(accessor["count"]) for accessor in accessors]
    if min(counts, default=0) < 0:
        raise AssetError(_DAMAGED)
    largest = max(counts, default=0)
    if largest > 3 * most or len(accessors) > max(PARTS, most // 1000):
        raise AssetError(
            f"The mesh has {max(largest // 3, len(accessors))} triangles or parts, too many. Simplify it. "
            f"{how_to_raise('max_mesh_triangles')}"
        )


def _count(document: dict[str, Any]) -> int:
    """Triangles of all nodes; a node that is in more places than one could stand for any number."""
    meshes = [
        sum(_triangles(part, document["accessors"]) for part in mesh["primitives"])
        for mesh in document["meshes"]
    ]
    nodes = document.get("nodes", [])
    children = [child for node in nodes for child in node.get("children", [])]
    if len(children) != len(set(children)):
        raise AssetError(_DAMAGED)
    return sum(meshes[node["mesh"]] for node in nodes if "mesh" in node)


def _triangles(primitive: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    place = primitive.get("indices", primitive["attributes"]["POSITION"])
    count = int(accessors[place]["count"])
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _STRIP:
        return max(0, count - 2)
    return count // 3 if mode == _TRIANGLES else 0
