"""OBJ meshes with their MTL materials."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np

from renderer.assets import AssetError
from service.converting.assets import check_mesh
from service.converting.errors import FileAwayError, wrong_at_line
from service.converting.meshes import scene_around
from service.converting.mtl_materials import GREY, MtlConverter
from service.converting.mtl_text import MtlMaterial, read_mtl
from service.converting.obj_parts import bent, by_material, half_textured, write_part
from service.converting.obj_text import ObjText, read_obj
from service.converting.surroundings import bounding_sphere
from service.converting.task import Task

UNNAMED = "default"
"""Name of the grey material of faces without one."""


def convert_obj(task: Task) -> dict[str, Any]:
    """The scene of an OBJ file: its materials, a camera that sees all of it, and a light.

    Raises
    ------
    ConversionError
        A line of the file, or of an MTL file, makes no sense.
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
        detail = "Normals are not those of the faces: the mesh is smoothed, with normals worked out anew."
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
        task.notes.assume("usemtl", f"The mesh is cut into {len(parts)} files, one for each material.")
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
            detail = "Faces with a texture have no coordinates (vt): write some, or their colour is odd."
            task.notes.assume("f", detail, line=face.line)
            return
