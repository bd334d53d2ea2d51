"""Scenes of each student: always the same, within their ranges, and of no use to anybody else."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from renderer import load_scene
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import Manifest
from service.grading.classes.class_grading import grade_class
from service.grading.classes.class_records import Student
from service.grading.variants import references_for
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels

TILTED = {"position": [1, 2, 8], "look_at": [0.5, 1, 0], "up": [1, 3, -1], "width": 48, "height": 32}
TURN, COLORS = 20.0, 0.25


def manifest(assignment: Assignment, **changes: object) -> Manifest:
    ranges = {"scenes": ["scene.json"], "secret": "autumn 2026", "turn": TURN, "colors": COLORS} | changes
    return read_manifest(assignment.manifest(image_test(), per_student=ranges).read_bytes(), yaml=False)


def scene_of(assignment: Assignment, student: str, **changes: object) -> bytes:
    return references_for(manifest(assignment, **changes), assignment.references, student).read("scene.json")


def test_scene_depends_on_the_student_alone_and_keeps_its_ranges(assignment: Assignment) -> None:
    document = SCENE | {"camera": TILTED}
    (assignment.references / "scene.json").write_text(json.dumps(document))
    texts = [scene_of(assignment, f"student {number}") for number in range(60)]
    assert len({*texts}) == 60
    assert scene_of(assignment, " Student 7") == texts[7]
    look_at, up = np.array(TILTED["look_at"]), np.array(TILTED["up"]) / math.sqrt(11)
    view = np.array(TILTED["position"]) - look_at
    flat = view - up * (view @ up)
    turns = []
    for text in texts:
        changed = load_scene(text).document
        moved = np.array(changed.camera.position) - look_at
        assert moved @ up == pytest.approx(view @ up, abs=1e-7)
        assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(view), abs=1e-7)
        side = moved - up * (moved @ up)
        turns.append(math.degrees(math.atan2(up @ np.cross(flat, side), flat @ side)))
        for name, material in changed.materials.items():
            before, after = np.array(document["materials"][name]["color"]), np.array(material.color)
            assert np.abs(after - before).max() <= COLORS + 1e-4
            assert 0 <= after.min() <= after.max() <= before.max()
    # Of 60 uniform draws one is beyond 0.8 on each side with probability 1 - 2 * 0.9^60.
    assert -TURN <= min(turns) < -0.8 * TURN < 0.8 * TURN < max(turns) <= TURN


@pytest.mark.slow
def test_picture_of_somebody_else_earns_nothing(assignment: Assignment, tmp_path: Path) -> None:
    right = pixels(json.loads(scene_of(assignment, "7")))
    students = [Student(tmp_path / "class" / "ada_7", "7"), Student(tmp_path / "class" / "bob")]
    for student in students:
        student.folder.mkdir(parents=True)
        np.save(student.folder / "picture.npy", right)
    graded = grade_class(manifest(assignment), students, references=assignment.references, jobs=2)
    assert [(found.grade.own_scenes, found.grade.score) for _, found in graded] == [(True, 10), (True, 0)]
    assignment.hand_in("picture.npy", right)
    read = manifest(assignment).model_dump(mode="json")["per_student"]
    assert assignment.grade(image_test(), members={"per_student": read}, student="7").score == 10
