"""Reading mesh files: OBJ, PLY and glTF.

Only the file itself is read, and the buffers beside a glTF file. Declared sizes are checked before anything
is allocated.
"""

import posixpath
import re

from renderer.assets import MISSING, NOT_THERE, AssetError, AssetSource, content_of, limits_of
from renderer.math.arrays import Floats, Integers
from renderer.meshes import gltf, gltf_packing
from renderer.meshes.gltf_geometry import read_glb
from renderer.meshes.obj import cut_into_triangles, read_obj
from renderer.meshes.ply import read_ply
from renderer.meshes.ply_header import header_of
from schemas.limits import how_to_raise, limits_in_force
from schemas.reading.file_kinds import recognise

# No other mesh format is JSON.
_JSON = re.compile(rb"(?:\xef\xbb\xbf)?\s*\{")
_FORMATS = "Use OBJ, PLY or glTF (GLB, or .gltf with its buffers)."
_GLTF = frozenset({"glb", "gltf"})


def read_mesh(name: str, assets: AssetSource) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V) or None of a file.

    Materials, and all other files that a mesh names but buffers of glTF, are left out.

    Raises
    ------
    AssetError
        If there is no such file, it is no mesh, it is damaged, or it has too many triangles.
    """
    content = content_of(name, assets)
    kind = file_kind(content)
    most = limits_of(assets).max_mesh_triangles
    announced(content, most)
    if kind == "obj":
        obj = read_obj(name, content)
        refuse_too_many(obj.triangle_count, most)
        return cut_into_triangles(obj)
    mesh = read_glb(glb_of(name, content, assets)) if kind in _GLTF else read_ply(content, most)
    if not mesh[1].size:
        raise AssetError("The mesh has no triangles.")
    refuse_too_many(mesh[1].shape[1], most)
    return mesh


def glb_of(name: str, content: bytes, assets: AssetSource) -> bytes:
    """A glTF file and its buffers as one GLB of geometry alone.

    Parameters
    ----------
    name
        Name of the file, from whose folder the buffers are named.
    content
        Its bytes.
    assets
        Source of the buffers.

    Raises
    ------
    AssetError
        If it is damaged, or a buffer cannot be read.
    """

    def read(uri: str) -> bytes:
        try:
            return content_of(posixpath.join(posixpath.dirname(name), uri), assets)
        except AssetError as error:
            is_gone = str(error) in {MISSING, NOT_THERE}
            why = f", which is not there. {_BESIDE}" if is_gone else f". {error}"
            raise AssetError(f"The mesh needs the file {uri[:_LONGEST_SHOWN]!r}{why}") from error

    return gltf_packing.packed(gltf.opened(content, limits_of(assets).max_mesh_triangles), read)


def self_contained(name: str, content: bytes, assets: AssetSource) -> bytes:
    """A self-contained mesh file: a `.gltf` file with its buffers becomes a GLB.

    Other files stay as they are, byte for byte, and so do those that are not meshes. Parameters and errors
    are those of `glb_of`.
    """
    most = limits_of(assets).max_mesh_triangles
    needs_packing = _JSON.match(content) or needs_other_files(content, most)
    return glb_of(name, content, assets) if needs_packing else content


def needs_other_files(content: bytes, most: int) -> bool:
    """Whether a file is glTF with buffers that lie elsewhere; AssetError if it is glTF and damaged."""
    is_gltf = content.startswith(b"glTF") or _JSON.match(content) is not None
    return is_gltf and bool(gltf.external_files(gltf.opened(content, most)))


_LONGEST_SHOWN = 100
"""Characters of a URI in a message; a data URI may have millions."""
_BESIDE = "Put it beside the mesh, or save the mesh as GLB."


def file_kind(content: bytes) -> str:
    """Kind of a mesh file, by its first bytes: names of uploaded files are arbitrary.

    Returns
    -------
    str
        `glb`, `gltf`, `ply` or `obj`.

    Raises
    ------
    AssetError
        If it is none of these.
    """
    kind = recognise(content)
    if kind and kind.group == "mesh":
        return kind.name
    if _JSON.match(content):
        return "gltf"
    given = f"This is {kind.phrase}, not a mesh." if kind else "This is not a mesh that can be read."
    raise AssetError(f"{given} {_FORMATS}")


def announced(content: bytes, most: int | None = None) -> int:
    """Least number of triangles or vertices that a file announces, without reading them.

    Parameters
    ----------
    content
        The whole file.
    most
        Most triangles; by default those of the limits in force.

    Raises
    ------
    AssetError
        If it is not a mesh, or declares more triangles than are allowed.
    """
    most = limits_in_force().max_mesh_triangles if most is None else most
    kind = file_kind(content)
    if kind in _GLTF:
        count = gltf.triangle_count(gltf.opened(content, most))
    elif kind == "ply":
        count = header_of(content).count
    else:
        count = content.count(b"\nf ")
    refuse_too_many(count, most)
    return count


def refuse_too_many(count: int, most: int) -> None:
    """Raise AssetError if a mesh has more triangles than are allowed."""
    if count > most:
        raise AssetError(
            f"The mesh has {count} triangles, more than the {most} allowed. Simplify it. "
            f"{how_to_raise('max_mesh_triangles')}"
        )
