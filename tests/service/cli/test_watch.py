"""What the error of a job costs, in words and on a terminal."""

from __future__ import annotations

import io
import re
from typing import Any

import pytest
from rich.console import Console

from schemas.api.plans import Convergence
from service.api.routes.pictures import CONVERGENCE_EXAMPLE as EXAMPLE
from service.cli import watch
from service.cli.progress import Bar, progress_bar
from service.cli.watch import Curve, sentences

NO_TERMINAL = Bar(None, None)
FOUND = Convergence.model_validate(EXAMPLE)


class Source:
    """Answers like a service whose job has so many finished passes, and counts the requests."""

    def __init__(self, finished: int) -> None:
        self.finished, self.asked = finished, 0

    def convergence(self, job_id: str) -> Convergence:
        self.asked += 1
        return FOUND.model_copy(update={"passes": FOUND.passes[: self.finished]})


def curve_of(source: Any, bar: Bar = NO_TERMINAL) -> Curve:
    return Curve(source, "a", bar)


def test_curve_in_sentences() -> None:
    assert list(sentences(FOUND, final=True)) == [
        "error 0.0081 (0.0079 to 0.0083), falling like time to the power -0.49 (-0.63 to -0.36)",
        "half of it would take 28 s more (7 to 120), 49 CPU s (12 to 211)",
    ]


def test_unbounded_cost_has_no_upper_end() -> None:
    costs: Any = {"seconds": {"estimate": 3, "low": 2, "high": None}} | {
        "cpu_seconds": {"estimate": 5, "low": 4, "high": None}
    }
    found = Convergence.model_validate(EXAMPLE | {"next_halving": costs, "reason": "For this."})
    assert list(sentences(found, final=False))[1:] == [
        "half of it would take 3 s more (2 or more), 5 CPU s (4 or more)",
        "For this.",
    ]


@pytest.mark.parametrize(("final", "reported"), [(True, ["For this."]), (False, [])])
def test_unknown_order_gives_its_reason(final: bool, reported: list[str]) -> None:
    unknown = {"passes": [], "order": None, "next_halving": None, "reason": "For this."}
    assert list(sentences(Convergence.model_validate(EXAMPLE | unknown), final=final)) == reported


def test_pass_is_a_line_on_a_pipe(
    capsys: pytest.CaptureFixture[str],
) -> None:
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


def test_unfinished_pass_waits(
    capsys: pytest.CaptureFixture[str],
) -> None:
    source = Source(1)
    curve = curve_of(source)
    curve.reach(2)
    assert capsys.readouterr().out.count("done") == 1
    source.finished = 3
    curve.finish()
    assert capsys.readouterr().out.count("done") == 2


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """A terminal 100 columns wide in place of stderr."""
    shown = io.StringIO()
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(
        "rich.console.Console",
        lambda **_: Console(
            file=shown, force_terminal=True, width=100, color_system=None, legacy_windows=False
        ),
    )
    return shown


def test_bars_halve_with_the_error(screen: io.StringIO) -> None:
    with progress_bar("waiting") as bar:
        curve = curve_of(Source(3), bar)
        curve.reach(2)
        curve.finish()
    lines = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue()).replace("\r", "\n").splitlines()
    letter = "\u2587"
    table = [line.rstrip() for line in lines if letter in line]
    # The errors are 0.032, about half and about a quarter of it; a half is two letters.
    full = watch.FULL
    assert [line.count(letter) for line in table] == [full, full - 2, full - 4]
    assert len({line.index(letter) for line in table}) == 1
    assert [line.split()[:4] for line in lines if "pass  seconds" in line] == [
        ["pass", "seconds", "CPU", "s"]
    ]
    assert any("the power -0.49" in line for line in lines)
    assert max(map(len, lines)) <= 100
