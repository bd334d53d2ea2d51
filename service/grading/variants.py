"""Scenes that differ from student to student: the camera turns, and colours change, by the student's id."""

from __future__ import annotations

import hashlib
import json
import math
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any

from schemas.grading.manifests import Manifest, PerStudent
from service.grading.errors import GradingError
from service.grading.folders import Folder

DIGITS = 9
"""Significant digits of a position: libraries of mathematics differ behind them."""


def references_for(manifest: Manifest, folder: Path, student: str | None) -> Folder:
    """The folder of the manifest with a student's own scenes in place of those that differ."""
    plain = Folder(folder.resolve(), "reference")
    if manifest.per_student is None or student is None:
        return plain
    return Folder(plain.root, plain.role, scenes_for(manifest.per_student, plain, student))


def scenes_for(ranges: PerStudent, folder: Folder, student: str) -> dict[str, bytes]:
    """The scenes of a student, by file.

    They depend on nothing but the ranges, the scene and the student, without regard to capitals and to the
    form of accents. A scene that cannot be read is left out.
    """
    who = unicodedata.normalize("NFKC", student).casefold().strip()
    found = {}
    for file in ranges.scenes:
        digest = hashlib.sha256(f"{ranges.secret}\0{file}\0{who}".encode("utf-8", "surrogatepass"))
        try:
            scene = _varied(json.loads(folder.read(file)), ranges, Random(digest.digest()))  # noqa: S311
            found[file] = json.dumps(scene, indent=1, ensure_ascii=False).encode()
        except (GradingError, ValueError, TypeError, KeyError, AttributeError):
            continue  # The tests that need it say what is wrong with it.
    return found


def _varied(scene: dict[str, Any], ranges: PerStudent, draw: Random) -> dict[str, Any]:
    turn = math.radians(ranges.turn * (2 * draw.random() - 1))
    camera = scene["camera"]
    materials = {name: _recolored(material, ranges, draw) for name, material in scene["materials"].items()}
    position = _turned(camera["position"], camera["look_at"], camera.get("up", (0, 1, 0)), turn)
    return scene | {"camera": camera | {"position": position}, "materials": materials}


def _turned(
    point: Sequence[float], center: Sequence[float], axis: Sequence[float], angle: float
) -> list[float]:
    """A point turned about an axis through a centre (Rodrigues' formula)."""
    x, y, z = (value / math.hypot(*axis) for value in axis)
    a, b, c = (value - origin for value, origin in zip(point, center, strict=True))
    along = (x * a + y * b + z * c) * (1 - math.cos(angle))
    across = y * c - z * b, z * a - x * c, x * b - y * a
    moved = (
        origin + value * math.cos(angle) + side * math.sin(angle) + unit * along
        for origin, value, side, unit in zip(center, (a, b, c), across, (x, y, z), strict=True)
    )
    return [float(f"{value:.{DIGITS}g}") for value in moved]


def _recolored(material: dict[str, Any], ranges: PerStudent, draw: Random) -> dict[str, Any]:
    color = material.get("color")
    if color is None:
        return material
    moved = (value + ranges.colors * (2 * draw.random() - 1) for value in color)
    return material | {"color": [round(min(max(value, 0.0), max(color)), 4) for value in moved]}
