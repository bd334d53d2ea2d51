"""Reading mesh files: OBJ, PLY and binary glTF, through trimesh."""

import io
import re
from typing import Any

import numpy as np

from renderer.arrays import Floats, Integers
from renderer.assets import AssetError, AssetSource

MAX_TRIANGLES = 2_000_000
"""Largest mesh that is read: some 400 bytes a triangle while rendering."""

_PLY_FACES = re.compile(rb"element\s+face\s+(\d+)")


def read_mesh(name: str, assets: AssetSource) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V) or None of a file.

    Nothing but the file itself is read: a mesh that names other files is read without them.

    Raises
    ------
    AssetError
        If there is no such file, it is no mesh, it is damaged, or it has more than `MAX_TRIANGLES`.
    """
    try:
        content = assets.read(name)
    except KeyError:
        raise AssetError(
            "There is no such file. Name one in the scene's folder, or upload it first and name it by its sha256."
        ) from None
    kind = file_kind(content)
    _refuse_too_many(_announced(kind, content))
    mesh = _load(kind, content)
    _refuse_too_many(len(mesh.faces))
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    if not len(mesh.faces) or not np.isfinite(vertices).all():
        raise AssetError("The mesh has no triangles, or coordinates that are no finite numbers.")
    texture = getattr(mesh.visual, "uv", None)
    return (
        np.ascontiguousarray(vertices.T),
        np.ascontiguousarray(np.asarray(mesh.faces, dtype=np.int64).T),
        None if texture is None else np.ascontiguousarray(np.asarray(texture, dtype=np.float64).T),
    )


def file_kind(content: bytes) -> str:
    """`glb`, `ply` or `obj`, by what the file begins with: names of uploaded files say nothing."""
    if content.startswith(b"glTF"):
        return "glb"
    if content.startswith(b"ply"):
        return "ply"
    if re.search(rb"(?m)^\s*v\s+[-+.\d]", content[:65536]):
        return "obj"
    raise AssetError("This is no mesh that can be read. Use OBJ, PLY or binary glTF (GLB).")


def _announced(kind: str, content: bytes) -> int:
    """Number of triangles that the file promises, at least; counted before anything is allocated."""
    if kind == "ply":
        header = content[: content.find(b"end_header")]
        found = _PLY_FACES.search(header)
        return int(found[1]) if found else 0
    return content.count(b"\nf ") if kind == "obj" else 0


def _refuse_too_many(count: int) -> None:
    if count > MAX_TRIANGLES:
        raise AssetError(
            f"The mesh has {count} triangles, more than the {MAX_TRIANGLES} allowed. Simplify it."
        )


def _load(kind: str, content: bytes) -> Any:
    try:
        import trimesh
    except ImportError as error:
        raise AssetError("Reading mesh files needs trimesh: pip install 'penumbra-render[mesh]'.") from error
    try:
        loaded = trimesh.load(
            io.BytesIO(content), file_type=kind, resolver=None, process=False, maintain_order=True
        )
        return loaded.to_geometry() if isinstance(loaded, trimesh.Scene) else loaded
    except Exception as error:
        raise AssetError(f"The mesh cannot be read as {kind.upper()}: it is damaged.") from error
