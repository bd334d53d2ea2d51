"""`penumbra doctor --numerics`, with catalogues of our own so that something can be wrong in them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import accuracy.hard_cases
from accuracy.hard_cases import Outcome, Section, section
from service.cli import numerics, output, trials
from service.cli.errors import ExitCode
from service.cli.process import outcome

RIGHT = Outcome(tried=1200, wrong=0, textbook=7, textbook_single=340, worst=0.25)


def section_of(**cases: Callable[[], Outcome]) -> Section:
    numbered = enumerate(cases.items(), start=1)
    return section("Doors", {f"Z{i}: {name.replace('_', ' ')}": run for i, (name, run) in numbered})


def breaks() -> Outcome:
    raise ZeroDivisionError("the door has no handle")


FINE = section_of(opens=lambda: RIGHT, without_formula=lambda: Outcome(tried=5, wrong=0))
FAULTY = section_of(
    opens=lambda: RIGHT,
    jams=lambda: Outcome(tried=40, wrong=3, textbook=9),
    breaks_off=breaks,
    shuts=lambda: RIGHT,
)


@pytest.fixture
def doctor(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str]]:
    """Run the command in this process, on a catalogue; give its exit code and what it printed."""

    def run(known: Section, *words: str) -> tuple[int, str]:
        monkeypatch.setattr(accuracy.hard_cases, "sections", lambda: (known,))
        monkeypatch.setattr(numerics, "MOST_WORKERS", 1)
        return outcome(["doctor", "--numerics", *words]), capsys.readouterr().out

    return run


Doctor = Callable[..., tuple[int, str]]


def test_every_case_is_a_line_with_its_counts_and_the_sum_comes_last(doctor: Doctor) -> None:
    code, out = doctor(FINE)
    lines = [line.split("\t") for line in out.splitlines()]
    assert code == ExitCode.DONE
    assert lines[0][:-1] == ["Doors", "Z1", "opens", "1,200", "0", "7", "340"]
    assert lines[1][:-1] == ["Doors", "Z2", "without formula", "5", "0", "–", "–"]
    assert re.findall(r"[\d,]+\b", lines[2][0])[:2] == ["2", "1,205"]
    assert lines[2][0].endswith("all right.")
    assert re.findall(r"\b\d+ ", lines[3][0]) == ["7 ", "340 "]


def test_a_wrong_answer_makes_the_exit_code_1_and_is_reported_again_at_the_end(doctor: Doctor) -> None:
    code, out = doctor(section_of(jams=lambda: Outcome(tried=40, wrong=3)))
    assert code == ExitCode.BELOW_THRESHOLD == 1
    assert "wrong Z1 Doors: jams: 3 of 40" in out
    assert "1 wrong" in out.splitlines()[-2]


def test_a_case_that_raises_is_wrong_with_its_message_and_the_others_still_run(doctor: Doctor) -> None:
    code, out = doctor(FAULTY, "--json")
    cases = {case["name"]: case for case in json.loads(out)["cases"]}
    assert code == ExitCode.BELOW_THRESHOLD
    assert list(cases) == ["opens", "jams", "breaks off", "shuts"]
    assert [case["right"] for case in cases.values()] == [True, False, False, True]
    assert cases["breaks off"]["error"].startswith("ZeroDivisionError: ")
    assert Path(__file__).name in cases["breaks off"]["error"]
    assert cases["breaks off"].keys() == cases["opens"].keys()
    assert cases["shuts"]["tried"] == RIGHT.tried


def test_a_message_of_a_broken_case_is_shown_to_people_too(doctor: Doctor) -> None:
    _, out = doctor(FAULTY)
    assert "breaks off: ZeroDivisionError: " in out
    assert "2 wrong" in out.splitlines()[-2]


def test_json_is_one_document_with_all_counts_and_their_sum(doctor: Doctor) -> None:
    code, out = doctor(FINE, "--json")
    document = json.loads(out)
    assert code == ExitCode.DONE
    first = document["cases"][0]
    assert first.pop("seconds") >= 0
    assert first == {
        "ids": ["Z1"],
        "section": "Doors",
        "name": "opens",
        "right": True,
        "tried": 1200,
        "wrong": 0,
        "textbook": 7,
        "textbook_single": 340,
        "worst": 0.25,
        "error": None,
    }
    total = document["total"]
    assert (total["cases"], total["right"], total["tried"], total["wrong"]) == (2, 2, 1205, 0)


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_keeps_every_count_whole_in_a_narrow_and_in_a_wide_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int
) -> None:
    name = "a case whose name is about as long as any of them gets to be"
    large = Outcome(tried=1_234_567, wrong=0, textbook=1_234_566, textbook_single=1_234_565)
    known = section_of(**{name: lambda: large})
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(output, "on_terminal", lambda: True)
    numerics.show(list(trials.one_after_another([known])))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    assert all(any(count in line for line in lines) for count in ("1,234,567", "1,234,566", "1,234,565"))
    assert set(name.split()) <= {word for line in lines for word in line.split()}


def test_without_the_package_for_exact_answers_the_command_says_how_to_get_it(tmp_path: Path) -> None:
    probe = (
        "import sys; sys.modules['mpmath'] = None\n"
        "from service.cli.main import main; main(['doctor', '--numerics'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == ExitCode.USAGE
    assert "mpmath" in done.stderr
    assert "pip install 'penumbra-render[numerics]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_cases_tried_in_other_processes_give_the_same_answers_in_the_same_order() -> None:
    catalogue = accuracy.hard_cases.sections()
    places = [(s, 0) for s, section in enumerate(catalogue) if section.cases][:3]
    assert places
    there = list(trials.in_processes(places, workers=2))
    here = [trials.attempt(catalogue[s], catalogue[s].cases[c]) for s, c in places]
    assert [(t.section, t.case, t.outcome) for t in there] == [(t.section, t.case, t.outcome) for t in here]
    assert all(trial.outcome is not None for trial in there)
