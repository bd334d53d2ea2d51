"""Validation of a glTF file by its description alone, before anything is allocated.

The description is small, and declares the unpacked size of the file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from renderer.assets import AssetError
from renderer.meshes.gltf_containers import DAMAGED, is_embedded, split_glb
from schemas.errors import SceneError
from schemas.limits import Limits, how_to_raise
from schemas.reading.documents import read_text

Json = dict[str, Any]

_MAX_JSON_BYTES = 8 * 1024 * 1024
"""Bytes of a GLB's description; parsed it takes some twenty times as much."""
MOST_VALUES = 1_000_000
"""Values of a description, whatever its data URIs contain."""
ALLOWED_PARTS = 2000
"""Parts that a mesh may have in any case, however few triangles it may have."""
_TRIANGLE_BYTES = 256
"""Bytes of all bufferViews in use, for each triangle that is allowed: many may be views of the same bytes.
Interleaved with normals, tangents and colours, the vertices of a separate triangle take some 150."""
STRIP, FAN = 5, 6
TRIANGLE_MODES = frozenset({4, STRIP, FAN})
"""Modes of primitives that have triangles: others are points and lines, which are left out."""
_FLOAT, _UNSIGNED = 5126, {5121, 5123, 5125}
_NORMALISED = frozenset({5121, 5123})
"""Whole numbers that may stand for texture coordinates."""
ATTRIBUTES = {"POSITION": "vertices", "TEXCOORD_0": "texture coordinates"}
"""Attributes that are read of a primitive, with their names in messages."""
_UNREAD = {
    "KHR_draco_mesh_compression": "compressed (Draco). Save it without compression.",
    "EXT_meshopt_compression": "compressed (meshopt). Save it without compression.",
    "KHR_meshopt_compression": "compressed (meshopt). Save it without compression.",
    "KHR_mesh_quantization": "quantised. Save it without quantisation.",
    "EXT_mesh_gpu_instancing": "written as instances. Save it with a node for each copy.",
}
"""Extensions that change the geometry."""


@dataclass(frozen=True, slots=True)
class GltfFile:
    """A glTF file whose description is parsed and checked.

    Attributes
    ----------
    document : dict
    binary : bytes or None
        The second chunk of a GLB.
    """

    document: Json
    binary: bytes | None


def opened(content: bytes, most: int) -> GltfFile:
    """Parse the description of a GLB, or of a `.gltf` file, and check what it announces.

    Parameters
    ----------
    content
        The whole file.
    most
        Most triangles that it may have.

    Raises
    ------
    AssetError
        If it is damaged, announces too much, or holds geometry in a way that is not read.
    """
    text, binary = split_glb(content) if content.startswith(b"glTF") else (content, None)
    with damage_reported():
        document = _parsed(text, longest=len(text) if text is content else _MAX_JSON_BYTES)
        _refuse_unread(document)
        _refuse_large(document, used_accessors(document), most)
        return GltfFile(document, binary)


@contextmanager
def damage_reported() -> Iterator[None]:
    """Report an inconsistent description as damaged, wherever that shows."""
    try:
        yield
    except AssetError:
        raise
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise AssetError(DAMAGED) from error


def external_files(file: GltfFile) -> list[str]:
    """URIs of the buffers that lie in other files."""
    uris = (buffer.get("uri") for buffer in file.document.get("buffers", []))
    return [uri for uri in uris if uri is not None and not is_embedded(uri)]


def triangle_count(file: GltfFile) -> int:
    """Triangles of all nodes of a file, as it announces them.

    Raises
    ------
    AssetError
        If a node is in more places than one: it could stand for any number.
    """
    with damage_reported():
        accessors, nodes = file.document["accessors"], file.document.get("nodes", [])
        meshes = [
            sum(_triangles(part, accessors) for part in mesh["primitives"])
            for mesh in file.document["meshes"]
        ]
        children = [child for node in nodes for child in node.get("children", [])]
        if len(children) != len(set(children)):
            raise AssetError(DAMAGED)
        return sum(meshes[node["mesh"]] for node in nodes if "mesh" in node)


def used_accessors(document: Json) -> list[int]:
    """Numbers of the accessors that hold geometry, in rising order."""
    used = set()
    for mesh in document["meshes"]:
        for part in mesh["primitives"]:
            used |= {part["attributes"][name] for name in ATTRIBUTES if name in part["attributes"]}
            used |= {part["indices"]} if "indices" in part else set()
    return sorted(used)


def _parsed(text: bytes, longest: int) -> Json:
    if len(text) > longest:
        raise AssetError(f"The description of the mesh has {len(text)} bytes; at most {longest} are allowed.")
    try:
        limits = Limits(max_body_bytes=longest, max_values=MOST_VALUES)
        document = read_text(text, limits).content
    except SceneError as error:
        first = error.errors[0]
        place = f" in line {first.line}, column {first.column}" if first.line else ""
        raise AssetError(f"The mesh cannot be read as glTF{place}: {first.detail}") from error
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise AssetError("This JSON file is not glTF: it has no 'asset' with a 'version'.")
    return document


def _refuse_unread(document: Json) -> None:
    version = document["asset"].get("version", "2.0")
    if not str(version).startswith("2."):
        raise AssetError("The mesh is not glTF 2.0, the supported version. Save it again.")
    for name in document.get("extensionsRequired", []):
        if name in _UNREAD:
            raise AssetError(f"The mesh is {_UNREAD[name]}")
    for node in document.get("nodes", []):
        mesh = document["meshes"][node["mesh"]] if "mesh" in node else {}
        if any(node.get("weights", mesh.get("weights", []))):
            raise AssetError("The mesh has morph targets in use. Apply them and save it again.")


def _refuse_large(document: Json, used: list[int], most: int) -> None:
    """A few bytes may stand for any number of vertices, all zero or all the same."""
    accessors = [document["accessors"][number] for number in used]
    if any("sparse" in accessor or "bufferView" not in accessor for accessor in accessors):
        raise AssetError("The mesh is compressed or sparse. Save it without compression.")
    counts = [int(accessor["count"]) for accessor in accessors]
    if min(counts, default=0) < 0:
        raise AssetError(DAMAGED)
    largest = max(counts, default=0)
    if largest > 3 * most or len(accessors) > max(ALLOWED_PARTS, most // 1000):
        raise AssetError(
            f"The mesh has {max(largest // 3, len(accessors))} triangles or parts, too many. Simplify it. "
            f"{how_to_raise('max_mesh_triangles')}"
        )
    views = {accessor["bufferView"] for accessor in accessors}
    size = sum(int(document["bufferViews"][view]["byteLength"]) for view in views)
    # A small limit of triangles still has room for the parts of an ordinary file.
    most_bytes = _TRIANGLE_BYTES * max(most, 1000 * ALLOWED_PARTS)
    if size > most_bytes:
        raise AssetError(
            f"The mesh has {size} bytes of numbers; at most {most_bytes} are allowed. Simplify it. "
            f"{how_to_raise('max_mesh_triangles')}"
        )
    for mesh in document["meshes"]:
        for part in mesh["primitives"]:
            _refuse_unsupported(part, document["accessors"])


def _refuse_unsupported(part: Json, accessors: list[Json]) -> None:
    for name, things in ATTRIBUTES.items():
        number = part["attributes"].get(name)
        if number is not None and not _is_read(name, accessors[number]):
            raise AssetError(
                f"Its {things} are quantised: whole numbers. Save the mesh with float32 numbers."
            )
    if "indices" in part and accessors[part["indices"]]["componentType"] not in _UNSIGNED:
        raise AssetError(DAMAGED)


def _is_read(name: str, accessor: Json) -> bool:
    kind = accessor["componentType"]
    is_share = kind in _NORMALISED and accessor.get("normalized", False)
    return kind == _FLOAT or (name == "TEXCOORD_0" and is_share)


def _triangles(primitive: Json, accessors: list[Json]) -> int:
    place = primitive.get("indices", primitive["attributes"]["POSITION"])
    count = int(accessors[place]["count"])
    mode = primitive.get("mode", 4)
    if mode in {STRIP, FAN}:
        return max(0, count - 2)
    return count // 3 if mode in TRIANGLE_MODES else 0
