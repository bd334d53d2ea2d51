from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from schemas.grading.grades import Grade
from tests.service.cli.conftest import CLEAN, COMMAND, Penumbra
from tests.service.grading.assignments import SCENE, Assignment, image_test, pixels, scene, scene_test


@pytest.fixture
def assignment(tmp_path: Path) -> Assignment:
    """A right picture and scene, handed in; the picture upside down too."""
    made = Assignment.of(tmp_path)
    made.hand_in("picture.npy", pixels(SCENE))
    made.hand_in("flipped.npy", pixels(SCENE)[::-1])
    return made


def flipped(**changes: Any) -> dict[str, Any]:
    return image_test(id="flipped", submitted={"file": "flipped.npy", "encoding": "linear"}, **changes)


WORDS = ("grade", "assignment/manifest.json", "--submission", "submission")


@pytest.mark.slow
def test_line_a_test_on_a_pipe(penumbra: Penumbra, assignment: Assignment) -> None:
    assignment.manifest(image_test(), flipped(points=2.5))
    outcome = penumbra(*WORDS)
    assert outcome.code == 0
    first, second, whole = outcome.out.splitlines()
    assert first.split("\t") == ["passed", "10/10", "A picture", "picture", ""]
    assert second.split("\t")[:4] == ["failed", "0/2.5", "A picture", "flipped"]
    assert "flipped_vertically" in second
    assert whole.startswith("10 of 12.5 ")
    assert whole.endswith(" mismatch")
    assert outcome.err == ""


def test_json_result(penumbra: Penumbra, assignment: Assignment) -> None:
    assignment.manifest(image_test())
    outcome = penumbra(*WORDS, "--student", "ada", "--submitted-at", "2026-11-21T20:15:00+00:00", "--json")
    found = Grade.model_validate(outcome.document)
    assert (found.score, found.student, found.submitted) == (10, "ada", "2026-11-21T20:15:00+00:00")
    assert outcome.document["schema"] == "penumbra/grade/v1"


@pytest.mark.slow
def test_folder_has_result_and_pictures(penumbra: Penumbra, assignment: Assignment, tmp_path: Path) -> None:
    assignment.manifest(image_test(), flipped())
    assert penumbra(*WORDS, "-o", "new/folder").code == 0
    found = Grade.model_validate_json((tmp_path / "new" / "folder" / "result.json").read_bytes())
    named = {image.file for test in found.tests for image in test.images}
    assert len(named) == 2
    assert {path.name for path in (tmp_path / "new" / "folder").iterdir()} == named | {"result.json"}


@pytest.mark.slow
def test_exports(penumbra: Penumbra, assignment: Assignment, tmp_path: Path) -> None:
    assignment.manifest(image_test())
    words = ("--export", "gradescope=results.json", "--export", "junit=report.xml")
    assert penumbra(*WORDS, *words).code == 0
    assert json.loads((tmp_path / "results.json").read_text())["score"] == 10
    assert (tmp_path / "report.xml").read_text().startswith("<?xml")


@pytest.mark.slow
@pytest.mark.parametrize(("least", "code"), [("10", 0), ("10.01", 1)])
def test_fail_under(penumbra: Penumbra, assignment: Assignment, least: str, code: int) -> None:
    assignment.manifest(image_test(), flipped())
    assert penumbra(*WORDS, "--fail-under", least).code == code


@pytest.mark.slow
def test_nothing_gradable_exit_code(penumbra: Penumbra, assignment: Assignment, tmp_path: Path) -> None:
    assignment.hand_in("picture.npy", np.full((32, 48, 3), np.nan, np.float32))
    assignment.manifest(image_test())
    outcome = penumbra(*WORDS, "-o", "out")
    assert outcome.code == 3
    # The dash is no zero.
    assert outcome.out.startswith("not_gradable\t-/10\t")
    assert json.loads((tmp_path / "out" / "result.json").read_text())["gradable"] is False


def test_wrong_manifest_has_its_lines(here: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "wrong.yaml").write_text("schema: penumbra/manifest/v1\ntitle: T\ntest: []\n")
    outcome = here("grade", "wrong.yaml")
    assert outcome.code == 3
    assert "/test  line 3, column 1" in outcome.err
    assert "'tests'" in outcome.err
    assert outcome.out == ""


@pytest.mark.parametrize(
    ("words", "code", "reported"),
    [
        (("grade", "none.yaml"), 3, "none.yaml"),
        (("grade", "manifest.txt"), 2, ".yaml"),
        ((*WORDS, "--submission", "nowhere"), 3, "nowhere"),
        ((*WORDS, "--export", "gradescop=a.json"), 2, "gradescope"),
        ((*WORDS, "--export", "gradescope=nowhere/a.json"), 2, "nowhere"),
        ((*WORDS, "--submitted-at", "yesterday"), 2, "yesterday"),
        ((*WORDS, "--server", "http://127.0.0.1:9"), 4, "127.0.0.1:9"),
    ],
)
def test_unusable_arguments(
    here: Penumbra, assignment: Assignment, words: tuple[str, ...], code: int, reported: str
) -> None:
    assignment.manifest(image_test())
    outcome = here(*words)
    assert outcome.code == code
    assert reported in outcome.err
    assert outcome.out == ""


@pytest.mark.slow
def test_lines_fit_a_terminal(assignment: Assignment, tmp_path: Path) -> None:
    assignment.manifest(image_test(), flipped(advice="See lecture 2, and " + "then " * 30))
    lines = on_a_terminal(80, *WORDS, folder=tmp_path)
    assert max(map(len, lines)) <= 80
    assert lines[0].split() == ["passed", "10/10", "A", "picture"]


def on_a_terminal(columns: int, *words: str, folder: Path) -> list[str]:
    """What the command writes on a terminal."""
    here, there = pty.openpty()
    done = subprocess.Popen(
        [*COMMAND, *words],
        stdout=there,
        stderr=subprocess.DEVNULL,
        cwd=folder,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3]), "COLUMNS": str(columns)},
    )
    os.close(there)
    written = b""
    try:
        while part := os.read(here, 4096):
            written += part
    except OSError:
        # The other end is closed.
        pass
    assert done.wait(timeout=60) == 0
    os.close(here)
    return re.sub(r"\x1b\[\d+m", "", written.decode()).splitlines()


@pytest.mark.slow
def test_ctrl_c_leaves_no_result(assignment: Assignment, tmp_path: Path) -> None:
    endless = scene(
        camera=SCENE["camera"] | {"width": 2048, "height": 2048},
        sampling={"antialiasing": {"pattern": "uniform", "samples": 4096}},
    )
    assignment.hand_in("endless.json", endless)
    assignment.manifest(scene_test(submitted={"file": "endless.json"}, deadline=600.0), image_test())
    running = subprocess.Popen(
        [*COMMAND, *WORDS, "-o", "out"],
        cwd=tmp_path,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not (started := _grandchildren(running.pid)):
        assert running.poll() is None
        time.sleep(0.05)
    running.send_signal(signal.SIGINT)
    _, reported = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "Interrupted" in reported
    assert not (tmp_path / "out" / "result.json").exists()
    assert not [process for process in started if Path(f"/proc/{process}").exists()]


def _grandchildren(process: int) -> list[int]:
    return [inner for child in _children(process) for inner in _children(child)]


def _children(process: int) -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except FileNotFoundError:
        return []
