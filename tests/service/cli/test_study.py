"""`penumbra study`, run as a user runs it."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from accuracy.study.report import CSV_COLUMNS
from tests.service.cli.conftest import CLEAN, COMMAND, Penumbra

ROOT = Path(__file__).parents[3]
FILES = ("results.json", "results.csv", "report.html", "report.md")


@pytest.mark.slow
def test_study_leaves_a_report(penumbra: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    done = penumbra("study", scene_file, "--out", out, "--quick")
    assert done.code == 0, done.err
    assert [question for question in QUESTIONS if question in done.out] == QUESTIONS
    assert str(out / "report.html") in done.err
    assert [name for name in FILES if not (out / name).stat().st_size] == []
    results = json.loads((out / "results.json").read_text())
    with (out / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(CSV_COLUMNS)
    assert [row["name"] for row in rows] == [row["name"] for row in results["settings"]]
    assert {float(row["reference_rmse_255"]) for row in rows} == {results["reference"]["rmse_255"]}


QUESTIONS = [
    "How long for this error?",
    "Which pattern should I use?",
    "Which effect costs most?",
    "Is double precision worth it?",
    "What error in 10 s?",
]


@pytest.mark.slow
def test_killed_study_resumes(penumbra: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = [*COMMAND, "study", str(scene_file), "--out", str(out), "--quick"]
    with subprocess.Popen(words, cwd=ROOT, env=CLEAN, stderr=subprocess.DEVNULL) as process:
        while len(journal(out)) < 10:
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    begun = [line for line in journal(out) if line.endswith("}")]
    assert not (out / "results.json").exists()
    results = penumbra("study", scene_file, "--out", out, "--quick", "--json").document
    entries = [json.loads(line) for line in journal(out) if line.endswith("}")]
    keys = [entry["key"] for entry in entries]
    assert journal(out)[: len(begun)] == begun
    assert len(set(keys)) == len(keys)
    assert results == json.loads((out / "results.json").read_text())
    assert results["runs"]["done"] == results["runs"]["planned"]


def journal(out: Path) -> list[str]:
    """Its lines; the last one may be in the making."""
    path = out / "journal.jsonl"
    return path.read_text().splitlines() if path.exists() else []


@pytest.mark.slow
def test_budget_leaves_runs_out(penumbra: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results: Any = penumbra(
        "study", scene_file, "--out", out, "--quick", "--budget", "0.1", "--json"
    ).document
    assert results["runs"]["done"] < results["runs"]["planned"]
    assert "did not fit the budget" in (out / "report.md").read_text()


@pytest.mark.parametrize("words", [["--budget", "0"], ["--side", "3"], []])
def test_invalid_options(penumbra: Penumbra, scene_file: Path, words: list[str]) -> None:
    out = ["--out", "out"] if words else []
    assert penumbra("study", scene_file, *out, *words).code == 2


def test_unusable_scene_is_refused_before_work(penumbra: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text('{"version": 1}')
    done = penumbra("study", "bad.json", "--out", tmp_path / "out", "--quick")
    assert done.code == 3
    assert not (tmp_path / "out").exists()


def test_missing_extra_is_refused_before_work(scene_file: Path, tmp_path: Path) -> None:
    """A module that says it is not there stands where the library would be."""
    stand_in = tmp_path / "matplotlib.py"
    stand_in.write_text('raise ModuleNotFoundError("No module named matplotlib")')
    path = f"{tmp_path}:{ROOT}"
    words = [*COMMAND, "study", str(scene_file), "--out", str(tmp_path / "out")]
    done = subprocess.run(
        words, cwd=tmp_path, env=CLEAN | {"PYTHONPATH": path}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "pip install 'penumbra-render[study]'" in done.stderr
    assert not (tmp_path / "out").exists()
