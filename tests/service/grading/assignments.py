"""Small assignments in a folder: scenes, references, a submission, and a manifest of some tests."""

import copy
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from PIL import Image

from renderer import compile_scene, load_scene, render
from renderer.images.colors import srgb_from_linear
from schemas.grading.grades import Grade, TestGrade
from schemas.grading.manifest_reading import read_manifest
from service.grading.grading import Graded, grade

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 2, 8], "look_at": [0, 1, 0], "vertical_fov": 38, "width": 48, "height": 32},
    "ambient": [1, 1, 1],
    "materials": {
        "floor": {"type": "phong", "color": [0.75, 0.75, 0.75], "ambient": 0.2},
        "ball": {"type": "phong", "color": [0.8, 0.2, 0.1], "ambient": 0.2},
    },
    "shapes": [
        {"type": "rectangle", "name": "table", "material": "floor"}
        | {"center": [0, 0, 0], "normal": [0, 1, 0], "tangent": [1, 0, 0], "size": [6, 6]},
        {"type": "ellipsoid", "name": "ball", "center": [0, 1, 0], "radius": 1, "material": "ball"},
    ],
    "lights": [{"type": "point", "position": [3, 5, 3], "color": [0.8, 0.8, 0.8]}],
    "sampling": {"antialiasing": {"pattern": "uniform", "samples": 4}},
}


def scene(**changes: Any) -> dict[str, Any]:
    """The scene with some members changed."""
    return copy.deepcopy(SCENE) | changes


def pixels(document: dict[str, Any]) -> np.ndarray:
    """The linear picture of a scene."""
    return render(compile_scene(load_scene(document))).image


def npy(values: np.ndarray) -> bytes:
    """An array as a file."""
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def codes_of(linear: np.ndarray) -> np.ndarray:
    """The codes of 8 bits of a linear picture."""
    codes: np.ndarray = np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1).astype(float))).astype(np.uint8)
    return codes


def png(codes: np.ndarray, **options: Any) -> bytes:
    """Codes of 8 bits as a file."""
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "PNG", **options)
    return file.getvalue()


REFERENCE = {"type": "scene", "file": "scene.json"}


def image_test(**changes: Any) -> dict[str, Any]:
    """A test of the kind `image`."""
    submitted = {"file": "picture.npy", "encoding": "linear"}
    return _test("image", "picture", "A picture") | {"submitted": submitted, "reference": REFERENCE} | changes


def scene_test(**changes: Any) -> dict[str, Any]:
    """A test of the kind `scene`."""
    return (
        _test("scene", "scene", "A scene")
        | {"submitted": {"file": "scene.json"}, "reference": REFERENCE}
        | changes
    )


def rays_test(**changes: Any) -> dict[str, Any]:
    """A test of the kind `rays`."""
    submitted = {"type": "hits", "file": "hits.npz"}
    return (
        _test("rays", "rays", "What rays hit") | {"submitted": submitted, "reference": "scene.json"} | changes
    )


def time_test(**changes: Any) -> dict[str, Any]:
    """A test of the kind `time`."""
    return (
        _test("time", "time", "How long it takes") | {"submitted": REFERENCE, "accept": {"full": 2}} | changes
    )


def _test(kind: str, test_id: str, name: str) -> dict[str, Any]:
    return {"id": test_id, "name": name, "kind": kind, "points": 10}


@dataclass(frozen=True)
class Assignment:
    """Folders of the manifest and of a submission, both with the scene."""

    references: Path
    submission: Path

    @classmethod
    def of(cls, folder: Path) -> Self:
        made = cls(folder / "assignment", folder / "submission")
        for inside in (made.references, made.submission):
            inside.mkdir()
            (inside / "scene.json").write_text(json.dumps(SCENE))
        return made

    def manifest(self, *tests: dict[str, Any], **members: Any) -> Path:
        """Write a manifest."""
        document = {"schema": "penumbra/manifest/v1", "title": "A ray tracer", "tests": tests} | members
        path = self.references / "manifest.json"
        path.write_text(json.dumps(document))
        return path

    def hand_in(self, name: str, content: Any) -> Path:
        """Add a file to the submission: an array, several arrays, bytes, or a document."""
        path = self.submission / name
        match content:
            case bytes():
                path.write_bytes(content)
            case np.ndarray():
                np.save(path, content)
            case _ if path.suffix == ".npz":
                np.savez(path, **content)
            case _:
                path.write_text(json.dumps(content))
        return path

    def run(self, *tests: dict[str, Any], members: dict[str, Any] | None = None, **options: Any) -> Graded:
        """Grade the submission by some tests."""
        manifest = read_manifest(self.manifest(*tests, **(members or {})).read_bytes(), yaml=False)
        return grade(
            manifest, references=self.references, submission=self.submission, **({"jobs": 2} | options)
        )

    def grade(self, *tests: dict[str, Any], **options: Any) -> Grade:
        """The grade without its pictures."""
        return self.run(*tests, **options).grade

    def test(self, test: dict[str, Any], **options: Any) -> TestGrade:
        """Grade the submission by a single test."""
        return self.grade(test, **options).tests[0]
