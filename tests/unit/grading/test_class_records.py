"""Which submissions of a class are graded again."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from schemas.grading.manifest_reading import read_manifest
from service.grading.class_records import (
    KEY,
    RESULT,
    Student,
    assignment_key,
    graded_before,
    students_of,
    submission_key,
)
from tests.unit.grading.assignments import Assignment, image_test, scene
from tests.unit.grading.exports.samples import result, tried


@pytest.fixture
def student(tmp_path: Path) -> Student:
    folder = tmp_path / "class" / "zoe"
    folder.mkdir(parents=True)
    (folder / "p.png").write_bytes(b"one")
    return Student(folder)


def test_submissions_are_folders_by_name(tmp_path: Path) -> None:
    for name in ("b", "a c", "zoë", ".git", "__MACOSX"):
        (tmp_path / name).mkdir()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "link").symlink_to(tmp_path / "b", target_is_directory=True)
    assert [student.name for student in students_of(tmp_path)] == ["a c", "b", "zoë"]


def test_a_key_stays_while_nothing_changes(student: Student) -> None:
    assert submission_key("k", student) == submission_key("k", student)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: (folder / "p.png").write_bytes(b"more"),
        lambda folder: (folder / "new.png").touch(),
        lambda folder: (folder / "p.png").rename(folder / "q.png"),
        lambda folder: os.utime(folder / "p.png", ns=(1, 1)),
        lambda folder: (folder / "p.png").unlink(),
    ],
    ids=["longer", "added", "renamed", "written again", "deleted"],
)
def test_a_changed_submission_has_another_key(student: Student, change: Callable[[Path], object]) -> None:
    before = submission_key("k", student)
    change(student.folder)
    assert submission_key("k", student) != before


def _key(assignment: Assignment, **changes: object) -> str:
    manifest = read_manifest(assignment.manifest(image_test(**changes)).read_bytes(), yaml=False)
    return assignment_key(manifest, assignment.references)


def test_the_key_of_an_assignment_depends_on_the_manifest_and_its_references(assignment: Assignment) -> None:
    first = _key(assignment)
    assert _key(assignment) == first
    assert _key(assignment, points=11) != first
    (assignment.references / "notes.txt").touch()
    assert _key(assignment) == first
    (assignment.references / "scene.json").write_text(json.dumps(scene(lights=[])))
    assert _key(assignment) != first


def test_a_missing_reference_has_a_key_too(assignment: Assignment) -> None:
    first = _key(assignment)
    (assignment.references / "scene.json").unlink()
    assert _key(assignment) != first


def test_only_a_complete_result_with_its_key_counts(tmp_path: Path) -> None:
    grade = result(tried())
    assert graded_before(tmp_path, "k") is None
    (tmp_path / RESULT).write_text(grade.model_dump_json())
    assert graded_before(tmp_path, "k") is None
    (tmp_path / KEY).write_text("k")
    assert graded_before(tmp_path, "k") == grade
    assert graded_before(tmp_path, "another") is None
    (tmp_path / RESULT).write_text("{")
    assert graded_before(tmp_path, "k") is None
