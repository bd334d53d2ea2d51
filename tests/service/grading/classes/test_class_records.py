"""Submissions of a class that are graded again."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from schemas.grading.manifest_reading import read_manifest
from service.grading.classes.class_records import (
    KEY,
    PRINTS,
    RESULT,
    Student,
    assignment_key,
    graded_before,
    packed,
    submission_key,
    submissions,
)
from service.grading.likeness.fingerprints import Fingerprint
from tests.service.grading.assignments import Assignment, image_test, rays_test, scene
from tests.service.grading.exports.samples import result, tried


@pytest.fixture
def student(tmp_path: Path) -> Student:
    folder = tmp_path / "class" / "zoe"
    folder.mkdir(parents=True)
    (folder / "p.png").write_bytes(b"one")
    return Student(folder)


def test_submissions_are_folders_by_name(tmp_path: Path) -> None:
    for name in ("b", "a c", "zoë", "Ada", "ada", "-rf", "l'été", "x" * 255, ".git", "__MACOSX"):
        (tmp_path / name).mkdir()
    for name in ("notes.txt", "late.zip", ".DS_Store"):
        (tmp_path / name).touch()
    (tmp_path / "link").symlink_to(tmp_path / "b", target_is_directory=True)
    students, others = submissions(tmp_path)
    assert [student.name for student in students] == sorted(
        ["-rf", "Ada", "a c", "ada", "b", "l'été", "x" * 255, "zoë"]
    )
    assert others == ("late.zip", "link", "notes.txt")


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: _replace(folder / "p.png", b"two"),
        lambda folder: (folder / "new.png").touch(),
        lambda folder: (folder / "p.png").rename(folder / "q.png"),
        lambda folder: (folder / "p.png").unlink(),
        lambda folder: (folder / "link").symlink_to("p.png"),
        lambda folder: os.mkfifo(folder / "pipe"),
    ],
    ids=["another content", "added", "renamed", "deleted", "link", "pipe"],
)
def test_changed_submission_has_another_key(student: Student, change: Callable[[Path], object]) -> None:
    before = submission_key("k", student)
    change(student.folder)
    assert submission_key("k", student) != before


def _replace(file: Path, content: bytes) -> None:
    """Write a file anew, as if it had not been touched."""
    status = file.stat()
    file.write_bytes(content)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


def test_copied_submission_has_the_same_key(student: Student) -> None:
    before = submission_key("k", student)
    os.utime(student.folder / "p.png", ns=(1, 1))
    assert submission_key("k", student) == before


def _key(assignment: Assignment, **changes: object) -> str:
    manifest = read_manifest(assignment.manifest(image_test(**changes)).read_bytes(), yaml=False)
    return assignment_key(manifest, assignment.references)


def test_assignment_key_depends_on_manifest_and_references(assignment: Assignment) -> None:
    first = _key(assignment)
    assert _key(assignment) == first
    assert _key(assignment, points=11) != first
    (assignment.references / "notes.txt").touch()
    assert _key(assignment) == first
    (assignment.references / "scene.json").write_text(json.dumps(scene(lights=[])))
    darker = _key(assignment)
    (assignment.references / "scene.json").unlink()
    assert len({first, darker, _key(assignment)}) == 3


def test_assignment_key_depends_on_all_files_that_tests_name(assignment: Assignment) -> None:
    picture = {"type": "picture", "file": "right.npy", "encoding": "linear", "scene": "right.json"}
    tests = (
        image_test(reference=picture, mask="mask.png"),
        rays_test(rays={"type": "file", "file": "rays.npz"}),
    )
    read = read_manifest(assignment.manifest(*tests).read_bytes(), yaml=False)
    keys = [assignment_key(read, assignment.references)]
    for name in ("right.npy", "right.npy.error.npy", "right.json", "mask.png", "rays.npz"):
        (assignment.references / name).write_text("{}")
        keys.append(assignment_key(read, assignment.references))
    assert len({*keys}) == len(keys)


def test_record_counts_only_complete_with_its_key(tmp_path: Path) -> None:
    grade = result(tried())
    prints = {"soft": Fingerprint(np.array([0.5, -1], np.float16), np.array([0, 2], np.float16))}
    parts = {RESULT: grade.model_dump_json().encode(), PRINTS: packed(prints), KEY: b"k"}
    for name, content in parts.items():
        assert graded_before(tmp_path, "k") is None
        (tmp_path / name).write_bytes(content)
    found = graded_before(tmp_path, "k")
    assert found is not None
    assert found.grade == grade
    assert packed(found.prints) == packed(prints)
    assert graded_before(tmp_path, "another") is None


@pytest.mark.parametrize("name", [RESULT, PRINTS, KEY])
@pytest.mark.parametrize("content", [b"", b"{", b"\xff", b"PK\x03\x04 cut off"])
def test_damaged_record_is_graded_again(tmp_path: Path, name: str, content: bytes) -> None:
    grade = result(tried()).model_dump_json().encode()
    for file, whole in ((RESULT, grade), (PRINTS, packed({})), (KEY, b"k")):
        (tmp_path / file).write_bytes(whole)
    assert graded_before(tmp_path, "k") is not None
    (tmp_path / name).write_bytes(content)
    assert graded_before(tmp_path, "k") is None


def test_file_that_no_test_opens_is_not_read(student: Student) -> None:
    with (student.folder / "huge.npy").open("wb") as file:
        # Reading its zeros takes longer than any time limit.
        file.truncate(1 << 42)
    before = submission_key("k", student)
    assert submission_key("k", student) == before
    os.truncate(student.folder / "huge.npy", 1 << 41)
    assert submission_key("k", student) != before
