"""Lines for people: excerpts of documents, sentences, and logs of jobs."""

from datetime import datetime

import pytest
from rich.text import Text

from schemas.api.jobs import LogEntry
from schemas.errors import Problem
from service.cli.jobs import _log_by_day, _log_lines
from service.cli.output import excerpts, folded


def shown(text: str, line: int, column: int) -> tuple[str, str]:
    """The line as shown, and the marker below it, both without their numbers."""
    problem = Problem(pointer="/a", detail="wrong", code="x", line=line, column=column)
    *_, source, marker = (Text.from_ansi(each).plain for each in excerpts(text.encode(), [problem]))
    start = source.index("|") + 2
    assert marker.index("|") + 2 == start
    return source[start:], marker[start:]


def test_caret_after_wide_letters() -> None:
    source, marker = shown('{"\u7403\u9762": x}', 1, 8)
    assert Text(source[: source.index("x")]).cell_len == marker.index("^")


def test_control_characters_are_escaped() -> None:
    source, marker = shown('"\x1b[31m\t\x07": 1', 1, 8)
    assert source.isprintable()
    assert marker.index("^") == 7


@pytest.mark.parametrize(("columns", "column"), [(20, 1), (40, 2000), (80, 3980)])
def test_long_line_is_cut_around_the_caret(
    monkeypatch: pytest.MonkeyPatch, columns: int, column: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    line = "".join(f"{number:04}" for number in range(1000))
    source, marker = shown(line, 1, column)
    # However narrow it is, 20 columns of the document are worth a wrapped line.
    assert max(len(source), len(marker)) <= max(columns - len("    1 | "), 20)
    assert line.index(source) + marker.index("^") == column - 1


@pytest.mark.parametrize("columns", [30, 80])
def test_sentence_folds_between_words(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    text = "The scene's service is away. Start it with 'penumbra serve --port 1', or wait until it isn't."
    lines = folded(text, indent="  ")
    assert len(lines) > 1
    assert max(map(len, lines)) <= columns
    assert " ".join(line.removeprefix("  ") for line in lines) == text
    assert any("'penumbra serve --port 1'" in line for line in lines)


def test_log_by_day_for_people_and_by_line_on_a_pipe() -> None:
    entries = (
        LogEntry(at=datetime(2026, 5, 1, 23, 59, 58).astimezone(), event="started", message="It began."),
        LogEntry(event="step_repeated", message="Tile 3\x1b of pass 1 was begun 2 times."),
        LogEntry(at=datetime(2026, 5, 2, 0, 0, 1).astimezone(), event="succeeded", message="It is done."),
    )
    assert list(_log_by_day(entries)) == [
        "2026-05-01",
        "  23:59:58  It began.",
        "            Tile 3  of pass 1 was begun 2 times.",
        "2026-05-02",
        "  00:00:01  It is done.",
    ]
    assert list(_log_lines(entries)) == [
        "2026-05-01 23:59:58\tstarted\tIt began.",
        "\tstep_repeated\tTile 3  of pass 1 was begun 2 times.",
        "2026-05-02 00:00:01\tsucceeded\tIt is done.",
    ]
