"""``penumbra grade --class`` with real folders."""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.unit.cli.conftest import Penumbra
from tests.unit.grading.assignments import SCENE, Assignment, image_test, pixels

WORDS = ("grade", "assignment/manifest.json", "--class", "class", "-o", "marks")
STRANGE = os.fsdecode(b"zo\xeb")


@pytest.fixture
def pupils(tmp_path: Path) -> Path:
    """A class: a right picture twice, one upside down, one under another name, and a name that is no text."""
    Assignment.of(tmp_path).manifest(image_test())
    right = pixels(SCENE)
    folder = tmp_path / "class"
    for name in ("ada", "=bob", "张 伟", "upper", STRANGE):
        (folder / name).mkdir(parents=True)
    for name in ("ada", "=bob"):
        np.save(folder / name / "picture.npy", right)
    np.save(folder / "张 伟" / "picture.npy", right[::-1])
    np.save(folder / "upper" / "picture.npy", right)
    (folder / "upper" / "picture.npy").rename(folder / "upper" / "PICTURE.NPY")
    (folder / STRANGE / "picture.npy").write_bytes(b"no picture")
    return folder


def entries(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {entry["student"]: entry for entry in document["students"]}


def test_a_class_gets_a_gradebook_a_page_and_a_folder_for_each_student(
    penumbra: Penumbra, pupils: Path, tmp_path: Path
) -> None:
    outcome = penumbra(*WORDS, "--json")
    assert outcome.code == 0, outcome.err
    found = entries(outcome.document)
    assert {name: entry["score"] for name, entry in found.items()} == {
        "=bob": 10,
        "ada": 10,
        "upper": 0,
        "zo\\xeb": 0,
        "张 伟": 0,
    }
    assert found["zo\\xeb"]["gradable"] is False
    assert outcome.document["shared_files"] == [{"students": ["=bob", "ada"], "tests": ["picture"]}]
    marks = tmp_path / "marks"
    assert json.loads((marks / "class.json").read_text()) == outcome.document
    content = (marks / "gradebook.csv").read_bytes()
    assert content.startswith(b"\xef\xbb\xbf")
    rows = list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))
    assert [row["student"] for row in rows] == ["'=bob", "ada", "upper", "zo\\xeb", "张 伟"]
    page = (marks / "index.html").read_text()
    for folder in pupils.iterdir():
        assert (marks / "students" / folder.name / "staff.html").is_file()
    assert "flipped_vertically" in page
    assert "students/zo%EB/staff.html" in page


def test_a_file_under_a_similar_name_is_named(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    assert penumbra(*WORDS).code == 0
    result = json.loads((tmp_path / "marks" / "students" / "upper" / "result.json").read_text())
    assert "Found PICTURE.NPY, wanted picture.npy" in result["tests"][0]["message"]


def test_only_changed_submissions_are_graded_again(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    first = penumbra(*WORDS, "--json").document
    results = {folder.name: tmp_path / "marks" / "students" / folder.name for folder in pupils.iterdir()}
    before = {name: (place / "result.json").stat().st_mtime_ns for name, place in results.items()}
    again = penumbra(*WORDS, "--json")
    assert "5 of 5 submissions have not changed" in again.err
    assert again.document == first
    np.save(pupils / "upper" / "picture.npy", pixels(SCENE))
    third = penumbra(*WORDS, "--json")
    assert "4 of 5 submissions have not changed" in third.err
    assert entries(third.document)["upper"]["score"] == 10
    after = {name: (place / "result.json").stat().st_mtime_ns for name, place in results.items()}
    assert {name for name in after if after[name] != before[name]} == {"upper"}


def test_an_interrupted_submission_is_graded_again(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    assert penumbra(*WORDS).code == 0
    # The key is written last.
    (tmp_path / "marks" / "students" / "ada" / "graded.key").unlink()
    assert "4 of 5 submissions have not changed" in penumbra(*WORDS).err


def test_a_changed_manifest_grades_all_again(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    assert penumbra(*WORDS).code == 0
    path = tmp_path / "assignment" / "manifest.json"
    path.write_text(path.read_text().replace('"points": 10', '"points": 20'))
    again = penumbra(*WORDS, "--json")
    assert "have not changed" not in again.err
    assert entries(again.document)["ada"]["score"] == 20


def test_an_export_is_a_file_of_each_student(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    assert penumbra(*WORDS, "--export", "html=page.html").code == 0
    for folder in pupils.iterdir():
        assert (tmp_path / "marks" / "students" / folder.name / "page.html").is_file()


def test_a_class_in_which_nothing_can_be_graded_is_unusable(penumbra: Penumbra, pupils: Path) -> None:
    for folder in pupils.iterdir():
        (folder / "picture.npy").write_bytes(b"no picture")
    assert penumbra(*WORDS).code == 3


@pytest.mark.parametrize(
    ("words", "code", "reported"),
    [
        (WORDS[:4], 2, "-o"),
        ((*WORDS[:4], "-o", "class/marks"), 2, "inside"),
        ((*WORDS[:3], "nowhere", "-o", "marks"), 3, "nowhere"),
        ((*WORDS[:3], "assignment", "-o", "marks"), 3, "has no folders"),
        ((*WORDS, "--student", "ada"), 2, "--student"),
        ((*WORDS, "--submission", "class/ada"), 2, "--submission"),
        ((*WORDS, "--fail-under", "0"), 2, "--fail-under"),
        ((*WORDS, "--export", "html=a/b.html"), 2, "without a folder"),
        ((*WORDS, "--export", "html=staff.html"), 2, "other than"),
        ((*WORDS, "--export", "htm=page.html"), 2, "html"),
    ],
)
def test_unusable_arguments_of_a_class_are_reported_before_anything_is_graded(
    here: Penumbra, pupils: Path, tmp_path: Path, words: tuple[str, ...], code: int, reported: str
) -> None:
    outcome = here(*words)
    assert outcome.code == code
    assert reported in outcome.err
    assert not (tmp_path / "marks" / "class.json").exists()
