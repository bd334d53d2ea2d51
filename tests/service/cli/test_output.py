from __future__ import annotations

import pytest
from rich.text import Text

from schemas.errors import Problem
from service.cli.output import excerpts, folded


def _problem(line: int, column: int) -> Problem:
    return Problem(pointer="/a", detail="wrong", code="x", line=line, column=column)


def _shown(text: str, line: int, column: int) -> tuple[str, int]:
    """The line as shown, and the position of the caret in it."""
    lines = [Text.from_ansi(line).plain for line in excerpts(text.encode(), [_problem(line, column)])]
    *_, source, marker = lines
    start = source.index("|") + 2
    assert marker.index("|") + 2 == start
    return source[start:], marker.index("^") - start


@pytest.mark.parametrize("column", [1, 4, 12])
def test_caret_under_the_column(column: int) -> None:
    line = '  "up": [0, 0, 0]'
    assert _shown(f"{{\n{line}\n}}", 2, column) == (line, column - 1)


def test_long_line_is_cut_around_the_caret() -> None:
    line = "".join(f"{number:04}" for number in range(1000))
    shown, caret = _shown(line, 1, 2000)
    assert len(shown) <= 100
    assert line.index(shown) + caret == 1999


@pytest.mark.parametrize("columns", [20, 40, 80])
@pytest.mark.parametrize("column", [1, 30, 2000, 4000, 9999])
def test_excerpt_fits_the_terminal(monkeypatch: pytest.MonkeyPatch, columns: int, column: int) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    lines = excerpts(("x" * 4000).encode(), [_problem(1, column)])
    source, marker = (Text.from_ansi(line).plain for line in lines[-2:])
    # However narrow it is, 20 columns of the document are worth a wrapped line.
    assert max(len(source), len(marker)) <= max(columns, len("    1 | ") + 20)


def test_caret_after_wide_letters() -> None:
    *_, source, marker = excerpts('{"\u7403\u9762": x}'.encode(), [_problem(1, 8)])
    before = Text.from_ansi(marker).plain.index("^")
    assert Text(source[: source.index("x")]).cell_len == before


def test_control_characters_are_escaped() -> None:
    shown, caret = _shown('"\x1b[31m\t\x07": 1', 1, 8)
    assert shown.isprintable()
    assert caret == 7


@pytest.mark.parametrize("columns", [30, 40, 80])
def test_sentence_folds_between_words(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    text = "The scene's service is away. Start it with 'penumbra serve --port 1', or wait until it isn't."
    lines = folded(text, indent="  ")
    assert len(lines) > 1
    assert max(map(len, lines)) <= columns
    assert " ".join(line.removeprefix("  ") for line in lines) == text
    assert any("'penumbra serve --port 1'" in line for line in lines)


def test_sentence_stays_whole_on_a_pipe(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    text = "word " * 100
    assert folded(text) == [text]
