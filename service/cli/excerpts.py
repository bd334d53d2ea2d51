"""Problems as people read them: place, sentence, and the line of their own file with a caret."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from schemas.problems import Problem
from service.cli.output import emphasis, harmless

LONGEST_LINE = 100
BEFORE_CARET = 60


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
    source = text.decode("utf-8", errors="replace").split("\n")
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
    start = max(0, column - 1 - BEFORE_CARET) if len(line) > LONGEST_LINE else 0
    gutter = f"    {number} | "
    yield gutter + harmless(line[start : start + LONGEST_LINE]).rstrip()
    yield " " * (len(gutter) - 2) + "| " + " " * (column - 1 - start) + emphasis("^", "red")
