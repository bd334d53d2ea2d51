"""``penumbra grade --class`` with real folders."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.service.cli.conftest import CLEAN, COMMAND, Penumbra
from tests.service.cli.test_grade import on_a_terminal
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels

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


def test_gradebook_page_and_folders(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
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
    result = json.loads((marks / "students" / "upper" / "result.json").read_text())
    assert "Found PICTURE.NPY, wanted picture.npy" in result["tests"][0]["message"]


@pytest.mark.slow
def test_changed_submissions_are_graded_again(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
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


@pytest.mark.slow
def test_changed_manifest_grades_all_again(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    assert penumbra(*WORDS).code == 0
    path = tmp_path / "assignment" / "manifest.json"
    path.write_text(path.read_text().replace('"points": 10', '"points": 20'))
    again = penumbra(*WORDS, "--json")
    assert "have not changed" not in again.err
    assert entries(again.document)["ada"]["score"] == 20


@pytest.mark.slow
def test_nothing_gradable_exit_code(penumbra: Penumbra, pupils: Path) -> None:
    for folder in pupils.iterdir():
        (folder / "picture.npy").write_bytes(b"no picture")
    assert penumbra(*WORDS).code == 3


@pytest.mark.slow
def test_interrupted_run_continues(pupils: Path, tmp_path: Path) -> None:
    for number in range(15):
        shutil.copytree(pupils / "ada", pupils / f"more-{number:02}")
    process = start(*WORDS, "--jobs", "1", folder=tmp_path)
    wait_for(tmp_path / "marks" / "students" / "ada" / "graded.key")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "of 20 submissions are graded. Run it again for the others." in err
    kept = len([*(tmp_path / "marks").glob("students/*/graded.key")])
    assert 2 <= kept < 20
    again = start(*WORDS, folder=tmp_path)
    _, err = again.communicate(timeout=120)
    assert again.returncode == 0, err
    assert f"{kept} of 20 submissions have not changed" in err


@pytest.mark.slow
def test_killed_run_leaves_whole_results(pupils: Path, tmp_path: Path) -> None:
    for number in range(15):
        shutil.copytree(pupils / "ada", pupils / f"more-{number:02}")
    process = start(*WORDS, "--jobs", "1", folder=tmp_path)
    wait_for(tmp_path / "marks" / "students" / "ada" / "graded.key")
    process.kill()
    process.wait()
    for key in (tmp_path / "marks").glob("students/*/graded.key"):
        assert json.loads(key.with_name("result.json").read_text())["schema"] == "penumbra/grade/v1"
    # The pipes close when the last child has ended.
    process.communicate(timeout=60)
    again = start(*WORDS, folder=tmp_path)
    _, err = again.communicate(timeout=120)
    assert again.returncode == 0, err
    assert "of 20 submissions have not changed" in err


def start(*words: str, folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMMAND, *words],
        cwd=folder,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(file: Path) -> None:
    until = time.monotonic() + 60
    while not file.exists():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.slow
def test_hostile_submissions(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    places = {name: pupils / name for name in ("bomb", "endless", "huge", "link", "nan", "pipe", "pickle")}
    for place in places.values():
        place.mkdir()
    (tmp_path / "secret.npy").write_bytes((pupils / "ada" / "picture.npy").read_bytes())
    (places["link"] / "picture.npy").symlink_to(tmp_path / "secret.npy")
    os.mkfifo(places["pipe"] / "picture.npy")
    np.save(places["nan"] / "picture.npy", np.full((32, 48, 3), np.nan, np.float32))
    np.save(places["pickle"] / "picture.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with (places["huge"] / "picture.npy").open("wb") as file:
        file.truncate(1 << 40)
    header = {"descr": "<f4", "fortran_order": False, "shape": (1 << 20, 1 << 20, 3)}
    with (places["bomb"] / "picture.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(file, header)
    (places["endless"] / "picture.npy").symlink_to("picture.npy")
    outcome = penumbra(*WORDS, "--json")
    assert outcome.code == 0, outcome.err
    found = entries(outcome.document)
    assert found["ada"]["score"] == 10
    assert {name for name in places if found[name]["gradable"]} == set()


@pytest.mark.slow
def test_table_fits_a_terminal(pupils: Path, tmp_path: Path) -> None:
    (pupils / ("x" * 200)).mkdir()
    lines = on_a_terminal(80, *WORDS, folder=tmp_path)
    assert max(map(len, lines)) <= 80
    found = [line.split() for line in lines if line.strip()]
    assert found[0] == ["points", "submission", "not", "graded", "signals"]
    assert ["10/10", "ada", "same", "files:", "picture"] in found


@pytest.mark.slow
def test_other_files_are_named(penumbra: Penumbra, pupils: Path) -> None:
    (pupils / "late.zip").touch()
    (pupils / "elsewhere").symlink_to(pupils / "ada", target_is_directory=True)
    outcome = penumbra(*WORDS, "--json")
    assert "Not submissions: elsewhere, late.zip. Put each submission into a folder" in outcome.err
    assert outcome.document["left_out"] == ["elsewhere", "late.zip"]


@pytest.mark.slow
def test_same_noise_is_shown_to_staff(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    right = pixels(SCENE)
    for seed in range(12):
        place = pupils / f"noisy-{seed:02}"
        place.mkdir()
        noise = np.random.default_rng(seed).normal(0, 0.02, right.shape[:2])[:, :, None]
        np.save(place / "picture.npy", (right + noise).astype(np.float32))
    (pupils / "thief").mkdir()
    copied = np.load(pupils / "noisy-03" / "picture.npy")
    np.save(pupils / "thief" / "picture.npy", copied * np.float32(1.01))
    first = penumbra(*WORDS, "--export", "html=page.html", "--json").document
    assert [group["students"] for group in first["shared_noise"]] == [["noisy-03", "thief"]]
    shutil.rmtree(pupils / "noisy-11")
    again = penumbra(*WORDS, "--export", "html=page.html", "--json").document
    assert again["shared_noise"] == first["shared_noise"]
    content = (tmp_path / "marks" / "gradebook.csv").read_text(encoding="utf-8-sig")
    rows = {row["student"]: row for row in csv.DictReader(io.StringIO(content, newline=""))}
    assert rows["thief"]["same_noise_as"] == "noisy-03: picture"
    for student in (tmp_path / "marks" / "students").iterdir():
        others = {"noisy-03", "thief"} - {student.name}
        assert not any(other in (student / "page.html").read_text() for other in others)


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
def test_unusable_arguments(
    here: Penumbra, pupils: Path, tmp_path: Path, words: tuple[str, ...], code: int, reported: str
) -> None:
    outcome = here(*words)
    assert outcome.code == code
    assert reported in outcome.err
    assert not (tmp_path / "marks" / "class.json").exists()
