"""No file outside the two folders is opened, and errors depend on the folder of a file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from service.grading import folders
from service.grading.errors import BrokenTestError, NotGradableError, NotSubmittedError
from service.grading.folders import Folder
from service.grading.rays.ray_sources import read_arrays


@pytest.fixture
def submission(tmp_path: Path) -> Folder:
    (tmp_path / "secret.txt").write_text("secret")
    inside = tmp_path / "submission"
    (inside / "deep").mkdir(parents=True)
    (inside / "deep" / "a.txt").write_text("a")
    return Folder(inside.resolve(), "submission")


def test_a_file_inside_is_read(submission: Folder) -> None:
    assert submission.read("deep/a.txt") == b"a"


def test_a_link_that_stays_inside_is_followed(submission: Folder) -> None:
    (submission.root / "b.txt").symlink_to("deep/a.txt")
    assert submission.read("b.txt") == b"a"


@pytest.mark.parametrize("name", ["../secret.txt", "deep/../../secret.txt", "link", "folder/secret.txt"])
def test_a_path_out_of_the_folder_is_refused(submission: Folder, name: str) -> None:
    (submission.root / "link").symlink_to("../secret.txt")
    (submission.root / "folder").symlink_to("..")
    with pytest.raises(NotGradableError, match="leads out of its folder"):
        submission.read(name)


def test_an_absolute_name_is_refused(submission: Folder, tmp_path: Path) -> None:
    with pytest.raises(NotGradableError, match="leads out"):
        submission.read(str(tmp_path / "secret.txt"))


def test_only_regular_files_are_opened(submission: Folder) -> None:
    # Opening a pipe would block until there is a writer.
    os.mkfifo(submission.root / "pipe")
    for name in ("pipe", "deep"):
        with pytest.raises(NotGradableError, match="not a file"):
            submission.read(name)
    (submission.root / "round").symlink_to("round")
    with pytest.raises(NotGradableError):
        submission.read("round")


def test_the_error_for_a_missing_file_depends_on_the_folder(submission: Folder) -> None:
    with pytest.raises(NotSubmittedError, match=r"none\.png was not submitted"):
        submission.read("none.png")
    with pytest.raises(BrokenTestError, match=r"none\.png is not beside the manifest"):
        Folder(submission.root, "reference").read("none.png")


def test_a_file_that_is_too_large_is_not_read(submission: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folders, "MOST_BYTES", 3)
    (submission.root / "large").write_bytes(bytes(4))
    with pytest.raises(NotGradableError, match="4 bytes"):
        submission.read("large")


def test_an_archive_that_unpacks_beyond_the_limit_is_refused(
    submission: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(submission.root / "bomb.npz", t=np.zeros(100_000))
    packed = (submission.root / "bomb.npz").stat().st_size
    assert packed < 10_000
    monkeypatch.setattr("service.grading.rays.ray_sources.MOST_BYTES", 100_000)
    with pytest.raises(NotGradableError, match="unpacks to"):
        read_arrays(submission, "bomb.npz", ("t",))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"no archive", r"not an \.npz file"),
        (b"PK\x03\x04 cut off", r"not an \.npz file"),
        ({"u": np.zeros(3)}, "no array 't'"),
        ({"t": np.array(["a", "b"])}, "real numbers"),
        ({"t": np.array([object()], dtype=object)}, r"not an \.npz file"),
    ],
    ids=["text", "half", "name", "letters", "pickle"],
)
def test_a_damaged_archive_is_reported(submission: Folder, content: object, said: str) -> None:
    path = submission.root / "hits.npz"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.savez(path, **content)
    with pytest.raises(NotGradableError, match=said):
        read_arrays(submission, "hits.npz", ("t",))
