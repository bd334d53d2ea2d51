import csv
import json
from pathlib import Path

import pytest

from accuracy.study.report import CSV_COLUMNS
from tests.service.cli.conftest import Penumbra, begun
from tests.service.support import TIMEOUT, until

QUESTIONS = [
    "How long for this error?",
    "Which pattern should I use?",
    "Which effect costs most?",
    "Is double precision worth it?",
    "What error in 10 s?",
]


@pytest.mark.slow
def test_killed_study_resumes_and_leaves_a_report(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    words = ("study", scene_file, "--out", out, "--quick")
    with begun(tmp_path, *words) as process:
        until(lambda: len(journal(out)) >= 10, TIMEOUT)
        assert process.poll() is None
        process.kill()
    before = [line for line in journal(out) if line.endswith("}")]
    assert not (out / "results.json").exists()
    results = here(*words, "--json").document
    lines = journal(out)
    assert lines[: len(before)] == before
    keys = [json.loads(line)["key"] for line in lines if line.endswith("}")]
    assert len(set(keys)) == len(keys)
    assert results["runs"]["done"] == results["runs"]["planned"]
    assert results == json.loads((out / "results.json").read_text())
    with (out / "results.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(CSV_COLUMNS)
    assert [row["name"] for row in rows] == [row["name"] for row in results["settings"]]
    assert all((out / f"report.{form}").stat().st_size for form in ("html", "md"))


def journal(out: Path) -> list[str]:
    """Its lines; the last one may be in the making."""
    path = out / "journal.jsonl"
    return path.read_text().splitlines() if path.exists() else []


@pytest.mark.slow
def test_budget_leaves_runs_out(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    done = here("study", scene_file, "--out", "out", "--quick", "--budget", "0.1")
    assert done.code == 0
    assert [question for question in QUESTIONS if question in done.out] == QUESTIONS
    runs = json.loads((tmp_path / "out" / "results.json").read_text())["runs"]
    assert runs["done"] < runs["planned"]
    assert "did not fit the budget" in (tmp_path / "out" / "report.md").read_text()


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["scene.json", "--out", "out", "--budget", "0"], 2),
        (["scene.json", "--out", "out", "--side", "3"], 2),
        (["scene.json"], 2),
        (["bad.json", "--out", "out"], 3),
    ],
)
@pytest.mark.usefixtures("scene_file")
def test_unusable_arguments(here: Penumbra, tmp_path: Path, words: list[str], code: int) -> None:
    (tmp_path / "bad.json").write_text('{"version": 1}')
    assert here("study", *words).code == code
    assert not (tmp_path / "out").exists()
