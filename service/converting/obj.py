"""OBJ meshes with their MTL materials."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats
from service.converting.errors import FileAwayError, wrong_at_line
from service.converting.mtl_materials import MtlConverter
from service.converting.surroundings import GREY, bounding_sphere, scene_around
from service.converting.task import Task, check_mesh
from service.converting.wavefront import Corner, Face, MtlMaterial, ObjText, read_mtl, read_obj

UNNAMED = "default"
"""Name of the grey material of faces without one."""


def convert_obj(task: Task) -> dict[str, Any]:
    """The scene of an OBJ file: its materials, a camera that sees all of it, and a light.

    Raises
    ------
    ConversionError
        A line of the file, or of an MTL file, is malformed.
    """
    obj = read_obj(task.path.name, task.content, task.notes)
    textures: dict[str, Any] = {}
    names = _scene_names(obj)
    materials = _materials(task, obj, names, textures)
    _note_missing_texture(task, obj, names, materials)
    vertices = np.array([obj.vertices[corner[0]] for face in obj.faces for corner in face.corners])
    return scene_around(
        task, vertices, textures=textures, materials=materials, shapes=_shapes(task, obj, names)
    )


def _scene_names(obj: ObjText) -> dict[str | None, str]:
    """Names in the scene of the materials that faces use; those without one get a name that is free."""
    used = by_material(obj)
    names = chain([UNNAMED], (f"{UNNAMED}-{number}" for number in count(2)))
    free = next(name for name in names if name not in used)
    return {name: free if name is None else name for name in used}


def _materials(
    task: Task, obj: ObjText, names: Mapping[str | None, str], textures: dict[str, Any]
) -> dict[str, Any]:
    written = _libraries(task, obj)
    diagonal = 2 * bounding_sphere(np.array(obj.vertices))[1]
    made: dict[str, Any] = {}
    for used, name in names.items():
        if used in written:
            folder, material = written[used]
            made[name] = MtlConverter(task, folder, diagonal, textures).convert(material)
        else:
            made[name] = _grey(task, obj, used)
    return made


def _grey(task: Task, obj: ObjText, name: str | None) -> dict[str, Any]:
    if name is None:
        detail = f"Faces without a material are grey, {GREY}."
        task.notes.assume("f", detail, line=next(face.line for face in obj.faces if face.material is None))
    else:
        detail = f"No MTL file that could be read has this material: it is grey, {GREY}."
        task.notes.assume(f"usemtl {name}", detail, line=obj.used[name])
    return {"type": "phong", "color": [GREY] * 3}


def _libraries(task: Task, obj: ObjText) -> dict[str | None, tuple[Path, MtlMaterial]]:
    """Materials of all MTL files, with the folders from which their pictures are named."""
    found: dict[str | None, tuple[Path, MtlMaterial]] = {}
    for name, line in obj.libraries:
        try:
            path, content = task.found.read(task.folder, name)
        except FileAwayError as error:
            task.notes.leave_out(f"mtllib {name}", str(error), line=line)
            continue
        for material in read_mtl(path.name, content).values():
            found.setdefault(material.name, (path.parent, material))
    return found


def _shapes(task: Task, obj: ObjText, names: Mapping[str | None, str]) -> list[dict[str, Any]]:
    assets = _assets(task, obj, names)
    smooth = bent(obj)
    if smooth:
        detail = "Normals are not those of the faces: the mesh is smoothed, with newly computed normals."
        task.notes.assume("vn", detail)
    return [
        {"type": "mesh", "name": name, "asset": asset, "material": name}
        | ({"smooth": True} if smooth else {})
        for name, asset in zip(names.values(), assets, strict=True)
    ]


def _assets(task: Task, obj: ObjText, names: Mapping[str | None, str]) -> list[str]:
    """Files of the parts, in the order of their materials: the file itself where it is all of one."""
    parts = by_material(obj)
    if len(parts) == 1 and not half_textured(obj.faces):
        _check(task, task.content)
        return [task.placed.keep(task.path.resolve(), task.content)]
    if len(parts) > 1:
        task.notes.assume("usemtl", f"The mesh is split into {len(parts)} files, one for each material.")
    assets = []
    for used, faces in parts.items():
        content = write_part(obj, faces)
        _check(task, content)
        assets.append(task.placed.make(f"{task.path.stem}-{names[used]}", ".obj", content))
    return assets


def _check(task: Task, content: bytes) -> None:
    try:
        check_mesh(content)
    except AssetError as error:
        raise wrong_at_line(task.path.name, task.content, 1, str(error)) from error


def _note_missing_texture(
    task: Task, obj: ObjText, names: Mapping[str | None, str], materials: Mapping[str, Any]
) -> None:
    for face in obj.faces:
        textured = "color_texture" in materials[names[face.material]]
        if textured and any(corner[1] is None for corner in face.corners):
            detail = (
                "Faces with a texture have no texture coordinates (vt): add them, or their colour is wrong."
            )
            task.notes.assume("f", detail, line=face.line)
            return


BENT = math.cos(math.radians(1.0))
"""A normal that is farther than one degree from that of its face means smooth shading. Files have normals
with three decimals or more, which turns them by less than 0.1 degrees; a sphere of 180 sides bends by 2."""


def bent(obj: ObjText) -> bool:
    """Whether some normal in the file is not that of its face, so that the mesh is meant to look smooth."""
    with_normals = [face for face in obj.faces if all(corner[2] is not None for corner in face.corners)]
    if not with_normals:
        return False
    vertices, normals = np.array(obj.vertices), np.array(obj.normals)
    first, second, third = (
        vertices[[face.corners[corner][0] for face in with_normals]] for corner in range(3)
    )
    of_faces = np.cross(second - first, third - first)
    counts = [len(face.corners) for face in with_normals]
    own = normals[[corner[2] for face in with_normals for corner in face.corners if corner[2] is not None]]
    return bool((cosines(np.repeat(of_faces, counts, axis=0), own) < BENT).any())


def cosines(a: Floats, b: Floats) -> Floats:
    """Absolute cosines between rows of (N, 3); 1 where a face has no area or a normal no length."""
    lengths = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    products = np.abs((a * b).sum(axis=1))
    quotients: Floats = np.divide(products, lengths, out=np.ones_like(lengths), where=lengths > 0)
    return quotients


def by_material(obj: ObjText) -> dict[str | None, list[Face]]:
    """Faces of each material, materials in the order of their first face."""
    parts: dict[str | None, list[Face]] = {}
    for face in obj.faces:
        parts.setdefault(face.material, []).append(face)
    return parts


def half_textured(faces: Iterable[Face]) -> bool:
    """Whether some corners have texture coordinates and others have none."""
    return len({corner[1] is None for face in faces for corner in face.corners}) > 1


def write_part(obj: ObjText, faces: Sequence[Face]) -> bytes:
    """An OBJ file of some faces and the vertices that they need; no digit of a number is lost.

    Where some corners have texture coordinates, those without get (0, 0).
    """
    corners = [corner for face in faces for corner in face.corners]
    places = _renumbered(corner[0] for corner in corners)
    texture = _renumbered(corner[1] for corner in corners)
    lines = [_numbers("v", obj.vertices[number]) for number in places if number is not None]
    lines += [_numbers("vt", obj.texture[number]) for number in texture if number is not None]
    if half_textured(faces):
        texture[None] = len(texture) + 1
        lines.append("vt 0 0")
    lines += ["f " + " ".join(_corner(corner, places, texture) for corner in face.corners) for face in faces]
    return ("\n".join(lines) + "\n").encode()


def _renumbered(numbers: Iterable[int | None]) -> dict[int | None, int]:
    """New numbers, from 1, of those that are used, in the order of their first use."""
    used = dict.fromkeys(number for number in numbers if number is not None)
    return {number: place for place, number in enumerate(used, 1)}


def _numbers(statement: str, numbers: Sequence[float]) -> str:
    return " ".join([statement, *map(repr, numbers)])


def _corner(corner: Corner, places: dict[int | None, int], texture: dict[int | None, int]) -> str:
    place = str(places[corner[0]])
    return f"{place}/{texture[corner[1]]}" if corner[1] in texture else place
