"""Names that people choose: text that every document can hold, and files under similar names."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from service.grading.folders import readable, similar
from tests.service.grading.assignments import Assignment, image_test


@pytest.mark.parametrize("name", ["zoë", "张伟", "a b", "=1+1", "<b>", "a\nb", "%20"])
def test_a_name_in_utf_8_is_its_own_text(name: str) -> None:
    assert readable(name) == name


def test_bytes_that_are_no_text_are_escaped_and_can_be_encoded() -> None:
    name = os.fsdecode(b"zo\xeb")
    assert readable(name) == "zo\\xeb"
    assert readable(name).encode() == b"zo\\xeb"


def test_different_names_have_different_texts() -> None:
    assert readable("zo\\xeb") != readable(os.fsdecode(b"zo\xeb"))


@pytest.mark.parametrize(
    "there",
    ["P.PNG", "p .png", "p (1).png", "p(2).png", "tracer/p.png", "a/b/P.png"],
)
def test_a_similar_name_is_found(tmp_path: Path, there: str) -> None:
    (tmp_path / there).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / there).touch()
    assert similar(tmp_path, "p.png") == there


def test_accents_may_be_encoded_differently(tmp_path: Path) -> None:
    (tmp_path / "e\u0301.png").touch()
    assert similar(tmp_path, "\u00e9.png") == "e\u0301.png"


@pytest.mark.parametrize("there", ["q.png", "p.jpg", "p.png.txt", ".p.png", "__MACOSX/p.png"])
def test_another_name_is_not_similar(tmp_path: Path, there: str) -> None:
    (tmp_path / there).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / there).touch()
    assert similar(tmp_path, "p.png") is None


def test_of_several_the_nearest_is_found(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    for there in ("old/p.png", "P.png"):
        (tmp_path / there).touch()
    assert similar(tmp_path, "p.png") == "P.png"


def test_no_link_is_followed(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    for folder in (inside, outside):
        folder.mkdir()
    (outside / "p.png").touch()
    (inside / "link").symlink_to(outside, target_is_directory=True)
    assert similar(inside, "p.png") is None


def test_a_missing_file_is_reported_with_the_similar_one(assignment: Assignment) -> None:
    assignment.hand_in("PICTURE.NPY", b"")
    found = assignment.test(image_test())
    assert found.status == "skipped"
    assert "picture.npy was not submitted. Found PICTURE.NPY, wanted picture.npy" in found.message
