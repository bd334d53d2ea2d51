"""OBJ meshes with their MTL materials."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import chain, count, islice
from pathlib import Path
from typing import Any

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats, Integers, Masks
from renderer.meshes.files import file_kind, refuse_too_many
from renderer.meshes.obj import MISSING, ObjError, ObjFile, cut_into_triangles, has_all, read_obj
from schemas.limits import limits_in_force
from schemas.quantities import LONGEST_NAME
from service.converting.errors import FileAwayError, wrong_at_line
from service.converting.mtl import MtlMaterial, read_mtl, without_comment
from service.converting.mtl_materials import MtlConverter
from service.converting.surroundings import DEFAULT_GREY, bounding_sphere, scene_around
from service.converting.task import Notes, Task

UNNAMED = "default"
"""Name of the grey material of faces without one."""
Parts = Mapping[str | None, Integers]
"""Numbers of the faces of each material."""


def convert_obj(task: Task) -> dict[str, Any]:
    """The scene of an OBJ file: its materials, a camera that sees all of it, and a light.

    Raises
    ------
    ConversionError
        A line of the file is malformed.
    """
    obj = _read(task)
    note_left_out(task.notes, task.path.name, obj)
    parts = by_material(obj)
    names = _scene_names(parts)
    textures: dict[str, Any] = {}
    materials = _materials(task, obj, parts, names, textures)
    _note_missing_texture(task, obj, parts, names, materials)
    shapes = _shapes(task, obj, parts, names)
    vertices = obj.vertices[obj.corners[:, 0]]
    return scene_around(task, vertices, textures=textures, materials=materials, shapes=shapes)


def _read(task: Task) -> ObjFile:
    name = task.path.name
    try:
        # Its name says what it is, and the renderer goes by its content.
        file_kind(task.content)
        obj = read_obj(name, task.content)
        refuse_too_many(obj.triangle_count, limits_in_force().max_mesh_triangles)
        # A concave face can have too many corners for the renderer.
        cut_into_triangles(obj)
    except ObjError as error:
        raise wrong_at_line(name, task.content, error.line, error.detail) from error
    except AssetError as error:
        raise wrong_at_line(name, task.content, 1, str(error)) from error
    return obj


def note_left_out(notes: Notes, name: str, obj: ObjFile) -> None:
    """Note which statements of an OBJ file are left out."""
    for keyword, lines in obj.left_out.items():
        detail = f"Statements '{keyword}' are left out: only triangles and polygons are read."
        if keyword == "v":
            detail = "Vertex colours are left out: a colour belongs to a material."
        for line in lines.tolist():
            notes.leave_out(keyword, detail, line=line, file=name)


def by_material(obj: ObjFile) -> Parts:
    """Faces of each material in the order of the file, materials in the order of their first face."""
    used = [*obj.used]
    numbers, first = np.unique(obj.materials, return_index=True)
    return {
        None if number == MISSING else used[number]: np.flatnonzero(obj.materials == number)
        for number in numbers[np.argsort(first)].tolist()
    }


def _scene_names(parts: Parts) -> dict[str | None, str]:
    """Names in the scene of the materials that faces use; without one, or with one too long, a free one."""
    fitting = {name for name in parts if name is not None and len(name) <= LONGEST_NAME}
    names: dict[str | None, str] = {}
    for used in parts:
        taken = fitting.union(names.values())
        free = (name for name in _spellings(used or UNNAMED) if name not in taken)
        names[used] = used if used is not None and used in fitting else next(free)
    return names


def _spellings(name: str) -> Iterator[str]:
    return chain([name[:LONGEST_NAME]], (f"{name[: LONGEST_NAME - 10]}-{number}" for number in count(2)))


def _materials(
    task: Task, obj: ObjFile, parts: Parts, names: Mapping[str | None, str], textures: dict[str, Any]
) -> dict[str, Any]:
    written = _libraries(task, obj)
    diagonal = 2 * bounding_sphere(obj.vertices)[1]
    made: dict[str, Any] = {}
    for used, name in names.items():
        found = None if used is None else written.get(used) or written.get(without_comment(used))
        if found is None:
            made[name] = _grey(task, obj, parts, used)
        else:
            folder, material = found
            made[name] = MtlConverter(task, folder, diagonal, textures).convert(material)
    return made


def _grey(task: Task, obj: ObjFile, parts: Parts, name: str | None) -> dict[str, Any]:
    if name is None:
        detail = f"Faces without a material are grey, {DEFAULT_GREY}."
        task.notes.assume("f", detail, line=int(obj.lines[parts[None][0]]))
    else:
        detail = f"No MTL file that could be read has this material: it is grey, {DEFAULT_GREY}."
        task.notes.assume(f"usemtl {name}", detail, line=obj.used[name])
    return {"type": "phong", "color": [DEFAULT_GREY] * 3}


def _libraries(task: Task, obj: ObjFile) -> dict[str, tuple[Path, MtlMaterial]]:
    """Materials of all MTL files, with the folders from which their pictures are named."""
    found: dict[str, tuple[Path, MtlMaterial]] = {}
    for text, line in obj.libraries:
        for name in _library_names(text):
            try:
                path, content = task.found.read(task.folder, name)
            except FileAwayError as error:
                task.notes.leave_out(f"mtllib {name}", str(error), line=line)
                continue
            for material in read_mtl(path.name, content, task.notes):
                found.setdefault(material.name, (path.parent, material))
    return {without_comment(name): material for name, material in found.items()} | found


def _library_names(text: str) -> list[str]:
    """Files of one statement: several, or one whose name has spaces."""
    words = without_comment(text).split()
    return words if sum(word.lower().endswith(".mtl") for word in words) > 1 else [without_comment(text)]


def _shapes(task: Task, obj: ObjFile, parts: Parts, names: Mapping[str | None, str]) -> list[dict[str, Any]]:
    assets = _assets(task, obj, parts, names)
    is_bent = bent_faces(obj)
    shapes = []
    for (used, faces), asset in zip(parts.items(), assets, strict=True):
        shape: dict[str, Any] = {"type": "mesh", "name": names[used], "asset": asset, "material": names[used]}
        if is_bent[faces].any():
            shape["smooth"] = True
            place = "vn" if used is None else f"usemtl {used}"
            detail = "Normals are not those of the faces: the mesh is smoothed, with newly computed normals."
            task.notes.assume(place, detail, line=int(obj.lines[faces[is_bent[faces]][0]]))
        shapes.append(shape)
    return shapes


def _assets(task: Task, obj: ObjFile, parts: Parts, names: Mapping[str | None, str]) -> list[str]:
    """Files of the parts, in the order of their materials: the file itself where it is all of one."""
    if len(parts) == 1:
        return [task.placed.keep(task.path.resolve(), task.content)]
    task.notes.assume("usemtl", f"The mesh is split into {len(parts)} files, one for each material.")
    assets = []
    for used, faces in parts.items():
        of_part = np.repeat(np.isin(np.arange(len(obj.sizes)), faces), obj.sizes)
        content = write_obj(obj.vertices, obj.texture, obj.corners[of_part, :2], obj.sizes[faces])
        assets.append(task.placed.make(f"{task.path.stem}-{names[used]}", ".obj", content))
    return assets


def _note_missing_texture(
    task: Task, obj: ObjFile, parts: Parts, names: Mapping[str | None, str], materials: Mapping[str, Any]
) -> None:
    bare = ~has_all(obj, obj.corners[:, 1])
    for used, faces in parts.items():
        if "color_texture" in materials[names[used]] and bare[faces].any():
            detail = (
                "Faces with a texture have no texture coordinates (vt): add them, or their colour is wrong."
            )
            task.notes.assume("f", detail, line=int(obj.lines[faces[bare[faces]][0]]))


SMOOTH_COSINE = math.cos(math.radians(1.0))
"""A normal that is farther than one degree from that of its face means smooth shading. Files have normals
with three decimals or more, which turns them by less than 0.1 degrees; a sphere of 180 sides bends by 2."""


def bent_faces(obj: ObjFile) -> Masks:
    """Faces (F,) that are meant to look smooth: some normal in the file is not that of the face."""
    starts, positions = np.cumsum(obj.sizes) - obj.sizes, obj.vertices[obj.corners[:, 0]]
    owners = np.repeat(np.arange(len(starts)), obj.sizes)
    following = np.arange(len(owners)) + 1
    following[starts + obj.sizes - 1] = starts
    arms = positions - positions[starts][owners]
    # The sum over all corners is right for concave faces too.
    of_faces = np.add.reduceat(np.cross(arms, arms[following]), starts)
    chosen = has_all(obj, obj.corners[:, 2])[owners]
    own = obj.normals[obj.corners[chosen, 2]]
    is_bent = cosines(of_faces[owners[chosen]], own) < SMOOTH_COSINE
    return np.bincount(owners[chosen], is_bent, len(starts)) > 0


def cosines(a: Floats, b: Floats) -> Floats:
    """Absolute cosines between rows of (N, 3); 1 where a face has no area or a normal no length."""
    lengths = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    products = np.abs((a * b).sum(axis=1))
    quotients: Floats = np.divide(products, lengths, out=np.ones_like(lengths), where=lengths > 0)
    return quotients


def write_obj(vertices: Floats, texture: Floats, corners: Integers, sizes: Integers) -> bytes:
    """An OBJ file of some faces with the vertices that they need; no digit of a number is lost.

    Parameters
    ----------
    vertices, texture
        Coordinates, (V, 3) and (U, 2).
    corners
        Numbers of the vertex and the texture coordinates of each corner, (C, 2); `MISSING` where it has none.
    sizes
        Corners of each face, (F,).
    """
    used, vertex = _renumbered(corners[:, 0])
    pairs, coordinate = _renumbered(corners[:, 1])
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices[used].tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in texture[pairs].tolist()]
    written = iter(
        f"{place}/{number}" if number else f"{place}"
        for place, number in zip(vertex.tolist(), coordinate.tolist(), strict=True)
    )
    lines += [" ".join(["f", *islice(written, size)]) for size in sizes.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _renumbered(numbers: Integers) -> tuple[Integers, Integers]:
    """Used numbers, in the order of their first use, and new ones from 1 for all; 0 for `MISSING`."""
    known, first, inverse = np.unique(numbers, return_index=True, return_inverse=True)
    order = np.argsort(np.where(known == MISSING, -1, first))
    ranks = np.empty_like(order)
    ranks[order] = np.arange(len(order))
    has_none = MISSING in known
    return known[order][has_none:], ranks[inverse] + (not has_none)
