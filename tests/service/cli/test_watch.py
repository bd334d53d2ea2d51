"""Convergence of a job, in words and on a terminal."""

import io
import re
from typing import Any

import pytest
from rich.console import Console

from schemas.api.plans import Convergence
from service.api.routes.pictures import CONVERGENCE_EXAMPLE as EXAMPLE
from service.cli.progress import Bar, progress_bar
from service.cli.watch import BAR_CELLS, Curve, sentences

FOUND = Convergence.model_validate(EXAMPLE)


class Source:
    """Answers like a service whose job has so many finished passes, and counts the requests."""

    def __init__(self, finished: int) -> None:
        self.finished, self.asked = finished, 0

    def convergence(self, job_id: str) -> Convergence:
        self.asked += 1
        return FOUND.model_copy(update={"passes": FOUND.passes[: self.finished]})


def curve_of(source: Any, bar: Bar | None = None) -> Curve:
    return Curve(source, "a", bar or Bar(None, None))


COSTS = {"seconds": {"estimate": 3, "low": 2, "high": None}}
COSTS |= {"cpu_seconds": {"estimate": 5, "low": 4, "high": None}}
ORDER = "error 0.0081 (0.0079 to 0.0083), falling like time to the power -0.49 (-0.63 to -0.36)"


@pytest.mark.parametrize(
    ("changes", "final", "reported"),
    [
        ({}, True, [ORDER, "half of it would take 28 s more (7 to 120), 49 CPU s (12 to 211)"]),
        (
            {"next_halving": COSTS, "reason": "For this."},
            False,
            [ORDER, "half of it would take 3 s more (2 or more), 5 CPU s (4 or more)", "For this."],
        ),
        ({"passes": [], "order": None, "next_halving": None, "reason": "For this."}, True, ["For this."]),
        ({"passes": [], "order": None, "next_halving": None, "reason": "For this."}, False, []),
    ],
    ids=["known", "unbounded", "unknown", "not yet known"],
)
def test_curve_in_sentences(changes: dict[str, Any], final: bool, reported: list[str]) -> None:
    assert list(sentences(Convergence.model_validate(EXAMPLE | changes), final=final)) == reported


def test_pass_is_a_line_on_a_pipe(capsys: pytest.CaptureFixture[str]) -> None:
    source = Source(3)
    curve = curve_of(source)
    for index in (0, 0, 1, 1, 2):
        curve.reach(index)
    lines = [line.split("\t") for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        ["pass 0 done", "0.60 s", "1.00 CPU s", "327680 rays", "error 0.032 (0.031 to 0.033)"],
        ["pass 1 done", "2.30 s", "4.00 CPU s", "1310720 rays", "error 0.016 (0.015 to 0.016)"],
    ]
    # The answer to the first question had both.
    assert source.asked == 1


def test_bars_halve_with_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=100, color_system=None, legacy_windows=False)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr("rich.console.Console", lambda **_: terminal)
    with progress_bar("waiting") as bar:
        curve = curve_of(Source(3), bar)
        curve.reach(2)
        curve.finish()
    lines = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue()).replace("\r", "\n").splitlines()
    letter = "\u2587"
    table = [line.rstrip() for line in lines if letter in line]
    # The errors are 0.032, about half and about a quarter of it; a half is two letters.
    assert [line.count(letter) for line in table] == [BAR_CELLS, BAR_CELLS - 2, BAR_CELLS - 4]
    assert len({line.index(letter) for line in table}) == 1
    assert any("the power -0.49" in line for line in lines)
    assert max(map(len, lines)) <= 100
