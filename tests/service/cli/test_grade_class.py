"""``penumbra grade --class`` with real folders."""

import csv
import io
import json
import os
import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from schemas.grading.classes import ClassEntry, ClassGrade, SharedFiles
from service.cli.grade_class import cells
from tests.service.cli.conftest import TIMEOUT, Penumbra, begun
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels
from tests.service.support import until

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


def gradebook(marks: Path) -> list[dict[str, str]]:
    content = (marks / "gradebook.csv").read_bytes()
    assert content.startswith(b"\xef\xbb\xbf")
    return list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline="")))


@pytest.mark.slow
def test_gradebook_page_and_folders(penumbra: Penumbra, pupils: Path, tmp_path: Path) -> None:
    (pupils / "late.zip").touch()
    (pupils / "elsewhere").symlink_to(pupils / "ada", target_is_directory=True)
    outcome = penumbra(*WORDS, "--json")
    assert outcome.code == 0, outcome.err
    assert "Not submissions: elsewhere, late.zip." in outcome.err
    assert outcome.document["left_out"] == ["elsewhere", "late.zip"]
    found = entries(outcome.document)
    scores = {"=bob": 10, "ada": 10, "upper": 0, "zo\\xeb": 0, "张 伟": 0}
    assert {name: entry["score"] for name, entry in found.items()} == scores
    assert found["zo\\xeb"]["gradable"] is False
    assert outcome.document["shared_noise"] == []
    assert outcome.document["shared_files"] == [{"students": ["=bob", "ada"], "tests": ["picture"]}]
    marks = tmp_path / "marks"
    assert json.loads((marks / "class.json").read_text()) == outcome.document
    assert [row["student"] for row in gradebook(marks)] == ["'=bob", "ada", "upper", "zo\\xeb", "张 伟"]
    page = (marks / "index.html").read_text()
    assert "flipped_vertically" in page
    assert "students/zo%EB/staff.html" in page
    for name in ("ada", "=bob", "张 伟", "upper", STRANGE):
        assert (marks / "students" / name / "staff.html").is_file()
    result = json.loads((marks / "students" / "upper" / "result.json").read_text())
    assert "Found PICTURE.NPY, wanted picture.npy" in result["tests"][0]["message"]


@pytest.mark.slow
def test_changed_submissions_are_graded_again(here: Penumbra, pupils: Path, tmp_path: Path) -> None:
    first = here(*WORDS, "--json").document
    results = [*(tmp_path / "marks" / "students").glob("*/result.json")]
    before = {path: path.stat().st_mtime_ns for path in results}
    np.save(pupils / "upper" / "picture.npy", pixels(SCENE))
    again = here(*WORDS, "--json")
    assert "4 of 5 submissions have not changed" in again.err
    assert entries(again.document)["upper"]["score"] == 10
    assert {path.parent.name for path in results if path.stat().st_mtime_ns != before[path]} == {"upper"}
    assert {**entries(again.document), "upper": 0} == {**entries(first), "upper": 0}
    path = tmp_path / "assignment" / "manifest.json"
    path.write_text(path.read_text().replace('"points": 10', '"points": 20'))
    third = here(*WORDS, "--json")
    assert "have not changed" not in third.err
    assert entries(third.document)["ada"]["score"] == 20


@pytest.mark.slow
def test_download_with_roster_and_points_of_staff(here: Penumbra, pupils: Path, tmp_path: Path) -> None:
    folder = tmp_path / "download"
    folder.mkdir()
    for name, owner in (("doejane_LATE_51_9_picture.npy", "ada"), ("roe_52_8_picture-1.npy", "张 伟")):
        shutil.copy(pupils / owner / "picture.npy", folder / name)
    late = {"deadline": "2026-11-21T23:59:00+01:00", "per_day": 0.25}
    Assignment(tmp_path / "assignment", folder).manifest(image_test(), late=late)
    (tmp_path / "roster.csv").write_text(
        "Student,ID,A ray tracer (7),submitted_at\n,51,,2026-11-22T08:00:00+01:00\n,52,,2026-11-21\n,53,9,\n"
    )
    words = (*WORDS[:3], "download", *WORDS[4:], "--roster", "roster.csv", "--overrides", "overrides.csv")
    overrides, marks = tmp_path / "overrides.csv", tmp_path / "marks"
    # A killed run left this.
    (marks / ".submissions" / "roe_52").mkdir(parents=True)
    for points in (4, 6):
        overrides.write_text(f"student,test,points,reason\nroe_52,picture,{points},Agreed\n")
        outcome = here(*words)
        assert outcome.code == 0, outcome.err
        cells = [row.split(",")[2] for row in (marks / "roster.csv").read_text().splitlines()]
        assert cells == ["A ray tracer (7)", "7.5", f"{points}.0", "9"]
        assert [row["score"] for row in gradebook(marks)] == ["7.5", f"{points}.0"]
    assert "1 of 2 submissions have not changed" in outcome.err
    assert "late: -2.5" in (marks / "index.html").read_text()
    assert "Agreed" in (marks / "students" / "roe_52" / "staff.html").read_text()
    assert [*marks.glob(".*")] == []
    overrides.write_text("student,test,points,reason\n52,picture,5,Late\nroe_52,picture,6,Agreed\n")
    outcome = here(*words)
    assert outcome.code == 3
    assert "lines 2 and 3 both set the points of roe_52 in picture" in outcome.err


def test_nothing_gradable_exit_code(here: Penumbra, pupils: Path) -> None:
    for folder in pupils.iterdir():
        (folder / "picture.npy").write_bytes(b"no picture")
    assert here(*WORDS).code == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)], ids=["interrupted", "killed"]
)
def test_ended_run_continues(
    here: Penumbra, pupils: Path, tmp_path: Path, number: signal.Signals, code: int
) -> None:
    for index in range(15):
        shutil.copytree(pupils / "ada", pupils / f"more-{index:02}")
    marks = tmp_path / "marks"
    process = begun(tmp_path, *WORDS, "--jobs", "1")
    until((marks / "students" / "ada" / "graded.key").exists, TIMEOUT)
    process.send_signal(number)
    # The pipes close when the last child has ended.
    _, err = process.communicate(timeout=TIMEOUT)
    assert process.returncode == code, err
    kept = [*marks.glob("students/*/graded.key")]
    assert 2 <= len(kept) < 20
    for key in kept:
        assert json.loads(key.with_name("result.json").read_text())["schema"] == "penumbra/grade/v1"
    if number == signal.SIGINT:
        assert f"{len(kept)} of 20 submissions are graded. Run it again for the others." in err
    again = here(*WORDS)
    assert again.code == 0, again.err
    assert f"{len(kept)} of 20 submissions have not changed" in again.err
    assert [*marks.glob(".*")] == []


@pytest.mark.slow
def test_hostile_submissions(here: Penumbra, pupils: Path, tmp_path: Path) -> None:
    places = {name: pupils / name for name in ("bomb", "endless", "huge", "link", "pipe", "pickle")}
    for place in places.values():
        place.mkdir()
    (tmp_path / "secret.npy").write_bytes((pupils / "ada" / "picture.npy").read_bytes())
    (places["link"] / "picture.npy").symlink_to(tmp_path / "secret.npy")
    (places["endless"] / "picture.npy").symlink_to("picture.npy")
    os.mkfifo(places["pipe"] / "picture.npy")
    np.save(places["pickle"] / "picture.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with (places["huge"] / "picture.npy").open("wb") as file:
        file.truncate(1 << 40)
    header = {"descr": "<f4", "fortran_order": False, "shape": (1 << 20, 1 << 20, 3)}
    with (places["bomb"] / "picture.npy").open("wb") as file:
        np.lib.format.write_array_header_1_0(file, header)
    outcome = here(*WORDS, "--json")
    assert outcome.code == 0, outcome.err
    found = entries(outcome.document)
    assert found["ada"]["score"] == 10
    assert {name for name in places if found[name]["gradable"]} == set()


@pytest.mark.slow
def test_table_fits_a_terminal(
    on_a_terminal: Penumbra, pupils: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (pupils / ("x" * 200)).mkdir()
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    done = on_a_terminal(*WORDS)
    _, ended, note = done.err.rpartition("100 %")
    assert ended
    assert " left" not in note
    # Nothing is graded, so no bar stays at 0 %.
    assert "grading" not in on_a_terminal(*WORDS).err
    lines = done.out.splitlines()
    assert max(map(len, lines)) <= 80
    found = [line.split() for line in lines if line.strip()]
    assert found[0] == ["points", "submission", "not", "graded", "signals"]
    assert ["10/10", "ada", "picture:", "identical_bytes;"] in found
    assert ["same", "files:", "picture"] in found


def test_tests_with_the_same_files_are_one_signal() -> None:
    ada = ClassEntry(student="ada", folder="students/ada", score=1, gradable=True, verdict="match")
    shared = (
        SharedFiles(students=("ada", *others), tests=(test,))
        for test, others in (("one", ["bob"]), ("two", ["bob", "zoe"]))
    )
    whole = ClassGrade(title="Spheres", max_score=2, students=(ada,), shared_files=tuple(shared))
    assert [*cells(whole)] == [["1/2", "ada", "", "same files: one, two"]]


@pytest.mark.parametrize(
    ("words", "code", "reported"),
    [
        (WORDS[:4], 2, "-o"),
        ((*WORDS[:4], "-o", "class/marks"), 2, "inside"),
        ((*WORDS[:3], "nowhere", "-o", "marks"), 3, "nowhere"),
        ((*WORDS[:3], "assignment", "-o", "marks"), 3, "has no folders"),
        ((*WORDS, "--student", "ada"), 2, "--student"),
        ((*WORDS, "--submitted-at", "2026-11-21"), 2, "--submitted-at"),
        ((*WORDS, "--overrides", "nobody.csv"), 3, "no submission is called 'nobody'"),
        ((*WORDS, "--fail-under", "0"), 2, "--fail-under"),
        ((*WORDS, "--export", "html=a/b.html"), 2, "without a folder"),
        ((*WORDS, "--export", "html=staff.html"), 2, "other than"),
        ((*WORDS, "--export", "htm=page.html"), 2, "html"),
    ],
)
@pytest.mark.usefixtures("pupils")
def test_unusable_arguments(
    here: Penumbra, tmp_path: Path, words: tuple[str, ...], code: int, reported: str
) -> None:
    (tmp_path / "nobody.csv").write_text("student,test,points,reason\nnobody,picture,1,Agreed\n")
    outcome = here(*words)
    assert outcome.code == code
    assert reported in outcome.err
    assert not (tmp_path / "marks" / "class.json").exists()
