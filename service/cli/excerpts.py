"""Problems as people read them: place, sentence, and the line of their own file with a caret."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.cells import cell_len

from schemas.problems import Problem
from service.cli import output
from service.cli.output import emphasis, harmless

LONGEST_LINE = 100
SHORTEST_LINE = 20
"""Columns of a line that are shown, however narrow the terminal is."""

BEFORE_CARET = 0.6
"""Share of a line that is too long which stands before the caret."""


def excerpts(text: bytes, problems: Sequence[Problem], more: int = 0, *, kind: str = "error") -> list[str]:
    """Lines that show each problem.

    Parameters
    ----------
    text
        The document; lines of it are shown where a problem has a line.
    problems, more
        What is wrong, and how many further problems there are.
    kind
        The word before each problem: ``error`` or ``warning``.
    """
    source = text.decode("utf-8-sig", errors="replace").split("\n")
    lines = [line for problem in problems for line in _one(source, problem, kind)]
    return [*lines, f"  ... and {more} more"] if more else lines


def _one(source: Sequence[str], problem: Problem, kind: str) -> Iterable[str]:
    yield f"  {emphasis(kind, 'red' if kind == 'error' else 'yellow')} {_place(problem)}"
    yield f"    {harmless(problem.detail)}"
    if problem.suggestion:
        yield f"    Did you mean {problem.suggestion!r}?"
    if problem.line is not None and problem.column is not None and problem.line <= len(source):
        yield from _marked(source[problem.line - 1], problem.line, problem.column)


def _place(problem: Problem) -> str:
    where = emphasis(harmless(problem.pointer) or "(whole document)")
    return where if problem.line is None else f"{where}  line {problem.line}, column {problem.column}"


def _marked(line: str, number: int, column: int) -> Iterable[str]:
    gutter = f"    {number} | "
    room = max(SHORTEST_LINE, min(LONGEST_LINE, output.width() - len(gutter)))
    before, after = _window(harmless(line), column - 1, room)
    yield gutter + (before + after).rstrip()
    yield " " * (len(gutter) - 2) + "| " + " " * cell_len(before) + emphasis("^", "red")


def _window(line: str, place: int, room: int) -> tuple[str, str]:
    """What is shown of a line before a place and from it on, together at most `room` cells."""
    before, after = line[:place], line[place:]
    if cell_len(line) > room:
        before = _beginning(before[::-1], int(BEFORE_CARET * room))[::-1]
        after = _beginning(after, room - cell_len(before))
    return before, after


def _beginning(text: str, cells: int) -> str:
    """As much of a text as has room in so many cells; some letters take two."""
    text = text[: cells + 1]
    while cell_len(text) > cells:
        text = text[:-1]
    return text
