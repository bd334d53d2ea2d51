"""An OBJ file cut by material, and what its normals say about smoothness."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from renderer.math.arrays import Floats
from service.converting.obj_text import Corner, Face, ObjText

BENT = math.cos(math.radians(1.0))
"""A normal that is farther than one degree from that of its face tells of smooth shading. Files have normals
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
