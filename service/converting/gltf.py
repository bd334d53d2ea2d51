"""glTF scenes: meshes with their materials, the first camera, and lights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from renderer.assets import AssetError
from renderer.meshes.gltf_containers import DAMAGED, split_glb
from renderer.meshes.obj import MISSING
from schemas.errors import SceneError
from schemas.limits import how_to_raise, limits_in_force
from schemas.reading.documents import read_text
from service.converting.errors import ConversionError, wrong_at
from service.converting.gltf_document import Document
from service.converting.gltf_geometry import Buffers, Part, parts_by_material
from service.converting.gltf_materials import GltfMaterials
from service.converting.gltf_nodes import camera_of, exposure, lights_of, placed_nodes
from service.converting.obj import write_obj
from service.converting.reading import read_known
from service.converting.surroundings import DEFAULT_GREY, bounding_sphere, scene_around
from service.converting.task import Task, free_name

KNOWN_EXTENSIONS = frozenset({"KHR_lights_punctual", "KHR_materials_ior", "KHR_materials_transmission"})


def convert_gltf(task: Task, content: object) -> dict[str, Any]:
    """The scene of a `.gltf` file whose JSON is parsed.

    Raises
    ------
    ConversionError
        At the invalid place.
    """
    return _scene(task, content, task.content.decode("utf-8-sig"), None)


def convert_glb(task: Task) -> dict[str, Any]:
    """The scene of a `.glb` file; raises as `convert_gltf`."""
    try:
        text, binary = split_glb(task.content)
        content = read_text(text, limits_in_force()).content
    except AssetError as error:
        raise wrong_at(task.notes.file, "", str(error)) from error
    except SceneError as error:
        raise ConversionError(task.notes.file, b"", error.errors, error.more) from None
    return _scene(task, content, None, binary)


def _scene(task: Task, content: object, text: str | None, binary: bytes | None) -> dict[str, Any]:
    if not isinstance(content, Mapping):
        raise wrong_at(task.notes.file, "", DAMAGED)
    document = read_known(content, Document, task.notes, text)
    _refuse_unknown(task, document)
    nodes = placed_nodes(task.notes.file, document)
    buffers = Buffers(task, document, binary)
    parts = parts_by_material(buffers, nodes)
    _check_triangle_count(task, parts)
    textures: dict[str, Any] = {}
    materials, shapes = _shapes(task, GltfMaterials(buffers, textures), parts)
    vertices = np.concatenate([part.vertices for some in parts.values() for part in some])
    middle, radius = bounding_sphere(vertices)
    lights = lights_of(task, document, nodes)
    scene = scene_around(
        task,
        vertices,
        textures=textures,
        materials=materials,
        shapes=shapes,
        camera=camera_of(task, document, nodes, middle),
        lights=lights,
    )
    stops = exposure(lights, middle, radius)
    if stops:
        scene["display"] = {"exposure": stops}
        task.notes.assume("", f"The picture is shown {-stops:g} stops darker, so that white is not above 1.")
    return scene


def _refuse_unknown(task: Task, document: Document) -> None:
    if not document.asset.version.startswith("2."):
        detail = f"This is glTF {document.asset.version!r}; only 2.0 is supported. Save it again."
        raise wrong_at(task.notes.file, "/asset/version", detail)
    for number, name in enumerate(document.extensions_required):
        if name not in KNOWN_EXTENSIONS:
            detail = f"The file needs the extension {name!r}, which is not supported. Save it without."
            raise wrong_at(task.notes.file, f"/extensionsRequired/{number}", detail)


def _check_triangle_count(task: Task, parts: Mapping[int | None, Sequence[Part]]) -> None:
    count = sum(len(part.triangles) for some in parts.values() for part in some)
    if count == 0:
        detail = "No mesh is placed in the scene, so there is nothing to see. Save it with its meshes."
        raise wrong_at(task.notes.file, "", detail)
    most = limits_in_force().max_mesh_triangles
    if count > most:
        detail = f"The meshes have {count} triangles; at most {most} are allowed. Simplify them."
        raise wrong_at(task.notes.file, "/meshes", f"{detail} {how_to_raise('max_mesh_triangles')}")


def _shapes(
    task: Task, converter: GltfMaterials, parts: Mapping[int | None, Sequence[Part]]
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    materials: dict[str, Any] = {}
    shapes = []
    for number, some in parts.items():
        name = _name(converter, number, materials)
        if number is None:
            materials[name] = {"type": "phong", "color": [DEFAULT_GREY] * 3}
            task.notes.assume("", f"Triangles without a material are grey, {DEFAULT_GREY}.")
        else:
            materials[name] = converter.convert(number)
        written = written_part(some)
        shape = {
            "type": "mesh",
            "name": name,
            "asset": task.placed.make(f"{task.path.stem}-{name}", ".obj", written),
            "material": name,
        }
        shapes.append(shape | ({"smooth": True} if any(part.bent for part in some) else {}))
    if any("smooth" in shape for shape in shapes):
        detail = "Normals are not those of the triangles: meshes are smoothed, with newly computed normals."
        task.notes.assume("/meshes", detail)
    return materials, shapes


def _name(converter: GltfMaterials, number: int | None, taken: Mapping[str, Any]) -> str:
    """A name that no other material has."""
    known = converter.buffers.document.materials
    own = known[number].name if number is not None and number < len(known) else "default"
    return free_name(own or f"material-{number}", taken)


def written_part(parts: Sequence[Part]) -> bytes:
    """An OBJ file of some parts, in world coordinates, without loss of precision."""
    corners, first, first_texture = [], 0, 0
    for part in parts:
        vertex = part.triangles.ravel()
        texture = np.full_like(vertex, MISSING) if part.texture is None else vertex + first_texture
        corners.append(np.stack([vertex + first, texture], axis=1))
        first += len(part.vertices)
        first_texture += 0 if part.texture is None else len(part.texture)
    return write_obj(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([np.empty((0, 2)), *(part.texture for part in parts if part.texture is not None)]),
        np.concatenate(corners),
        np.full(sum(len(part.triangles) for part in parts), 3),
    )
