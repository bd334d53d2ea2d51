"""No file outside the two folders is opened; errors depend on the folder; similar names are found."""

import os
from pathlib import Path

import numpy as np
import pytest

from service.grading import folders
from service.grading.errors import NotGradableError
from service.grading.folders import Folder, similar
from service.grading.rays.ray_sources import read_arrays


@pytest.fixture
def submission(tmp_path: Path) -> Folder:
    (tmp_path / "secret.txt").write_text("secret")
    inside = tmp_path / "submission"
    (inside / "deep").mkdir(parents=True)
    (inside / "deep" / "a.txt").write_text("a")
    return Folder(inside.resolve(), "submission")


def test_link_that_stays_inside_is_followed(submission: Folder) -> None:
    (submission.root / "b.txt").symlink_to("deep/a.txt")
    assert submission.read("b.txt") == submission.read("deep/a.txt") == b"a"


@pytest.mark.parametrize(
    "name", ["../secret.txt", "deep/../../secret.txt", "link", "folder/secret.txt", "/etc/passwd"]
)
def test_path_out_of_the_folder_is_refused(submission: Folder, name: str) -> None:
    (submission.root / "link").symlink_to("../secret.txt")
    (submission.root / "folder").symlink_to("..")
    with pytest.raises(NotGradableError, match="leads out"):
        submission.read(name)


def test_pipe_folder_and_circle_are_refused(submission: Folder) -> None:
    # Opening a pipe would block until there is a writer.
    os.mkfifo(submission.root / "pipe")
    (submission.root / "round").symlink_to("round")
    for name in ("pipe", "deep", "round"):
        with pytest.raises(NotGradableError):
            submission.read(name)


def test_large_file_is_refused(submission: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folders, "MOST_BYTES", 3)
    (submission.root / "large").write_bytes(bytes(4))
    with pytest.raises(NotGradableError, match="4 bytes"):
        submission.read("large")


def test_archive_that_unpacks_beyond_the_limit_is_refused(
    submission: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(submission.root / "bomb.npz", t=np.zeros(100_000))
    assert (submission.root / "bomb.npz").stat().st_size < 10_000
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
def test_damaged_archive_is_refused(submission: Folder, content: object, said: str) -> None:
    path = submission.root / "hits.npz"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.savez(path, **content)
    with pytest.raises(NotGradableError, match=said):
        read_arrays(submission, "hits.npz", ("t",))


@pytest.mark.parametrize(
    ("there", "found"),
    [
        *((name, True) for name in ("P.PNG", "p .png", "p (1).png", "p(2).png", "tracer/p.png", "a/b/P.png")),
        *((name, False) for name in ("q.png", "p.jpg", "p.png.txt", ".p.png", "__MACOSX/p.png")),
    ],
)
def test_similar_name_is_found(tmp_path: Path, there: str, found: bool) -> None:
    (tmp_path / there).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / there).touch()
    assert similar(tmp_path, "p.png") == (there if found else None)
