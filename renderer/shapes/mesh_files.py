"""Reading mesh files: OBJ, PLY and binary glTF, through trimesh.

Nothing but the file itself is read. What it announces is counted before anything is allocated for it.
"""

import io
import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from renderer.arrays import Floats, Integers
from renderer.assets import AssetError, AssetSource
from renderer.shapes import gltf
from renderer.warning_filters import changed_filters
from schemas.limits import MAX_TRIANGLES
from schemas.quantities import LARGEST

# A number of more digits is too large, and too long for Python to read.
_PLY_COUNTS = re.compile(rb"(?m)^element[ \t]+(?:face|vertex)[ \t]+(\d{1,18})")
_OBJ_VERTEX = re.compile(rb"(?m)^[ \t]*v[ \t]+[-+.\d]")
_OBJ_GROUP = re.compile(rb"(?m)^[ \t]*(?:mtllib|usemtl|o|g|s)(?:[ \t].*)?$")
_BEGINNING = 1 << 16


def read_mesh(name: str, assets: AssetSource) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V) or None of a file.

    Materials and all other files that a mesh names are left out.

    Raises
    ------
    AssetError
        If there is no such file, it is no mesh, it is damaged, or it has too many triangles.
    """
    content = content_of(name, assets)
    kind = file_kind(content)
    announced(content)
    return _arrays(_load(kind, _GEOMETRY[kind](content)))


def _without_groups(content: bytes) -> bytes:
    """An OBJ file as one mesh, its triangles in the order in which they stand."""
    return _OBJ_GROUP.sub(b"", content)


_GEOMETRY: dict[str, Callable[[bytes], bytes]] = {
    "glb": gltf.geometry_alone,
    "obj": _without_groups,
    "ply": bytes,
}


def content_of(name: str, assets: AssetSource) -> bytes:
    """Bytes of a file; raises AssetError if there is none of that name."""
    try:
        return assets.read(name)
    except KeyError:
        raise AssetError(
            "There is no such file. "
            "Name one in the scene's folder, or upload it first and name it by its sha256."
        ) from None


def file_kind(content: bytes) -> str:
    """Kind of a mesh file, by what it begins with: names of uploaded files say nothing.

    Returns
    -------
    str
        `glb`, `ply` or `obj`.

    Raises
    ------
    AssetError
        If it is none of these.
    """
    if content.startswith(b"glTF"):
        return "glb"
    if content.startswith(b"ply"):
        return "ply"
    if _OBJ_VERTEX.search(content[:_BEGINNING]):
        return "obj"
    raise AssetError("This is no mesh that can be read. Use OBJ, PLY or binary glTF (GLB).")


def announced(content: bytes) -> int:
    """Number of triangles or vertices that a file promises, at least, without reading them.

    Raises
    ------
    AssetError
        If it is no mesh, or promises more triangles than are allowed.
    """
    kind = file_kind(content)
    if kind == "glb":
        count = gltf.triangle_count(content)
    elif kind == "ply":
        header = content[: content.find(b"end_header")][:_BEGINNING]
        count = max((int(found) for found in _PLY_COUNTS.findall(header)), default=0)
    else:
        count = content.count(b"\nf ")
    _refuse_too_many(count)
    return count


def _refuse_too_many(count: int) -> None:
    if count > MAX_TRIANGLES:
        raise AssetError(
            f"The mesh has {count} triangles, more than the {MAX_TRIANGLES} allowed. Simplify it."
        )


def _load(kind: str, content: bytes) -> Any:
    try:
        # Scenes without mesh files are rendered where it is not installed.
        import trimesh  # noqa: PLC0415
    except ImportError as error:
        raise AssetError("Reading mesh files needs trimesh: pip install 'penumbra-render[mesh]'.") from error
    try:
        with changed_filters():
            # NumPy tells by this that an OBJ has words where it should have numbers.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            loaded: Any = trimesh.load(io.BytesIO(content), file_type=kind, process=False)
        return loaded.to_geometry() if isinstance(loaded, trimesh.Scene) else loaded
    except Exception as error:
        raise AssetError(f"The mesh cannot be read as {kind.upper()}: it is damaged.") from error


def _arrays(mesh: Any) -> tuple[Floats, Integers, Floats | None]:
    triangles = np.asarray(getattr(mesh, "faces", ()), dtype=np.int64).reshape(-1, 3)
    vertices = np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    texture = getattr(getattr(mesh, "visual", None), "uv", None)
    _refuse_too_many(len(triangles))
    if not len(triangles):
        raise AssetError("The mesh has no triangles.")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise AssetError(f"A triangle names a vertex that is not among the {len(vertices)} of the mesh.")
    _refuse_odd_numbers("vertices", vertices)
    if texture is not None:
        texture = np.asarray(texture, dtype=np.float64)
        if texture.shape != (len(vertices), 2):
            raise AssetError("The mesh does not have one pair of texture coordinates for each vertex.")
        _refuse_odd_numbers("texture coordinates", texture)
        texture = np.ascontiguousarray(texture.T)
    return np.ascontiguousarray(vertices.T), np.ascontiguousarray(triangles.T), texture


def _refuse_odd_numbers(things: str, numbers: Floats) -> None:
    if not (np.abs(numbers) <= LARGEST).all():
        raise AssetError(f"Some {things} of the mesh are no finite numbers, or beyond {LARGEST:g}.")
