"""Output of commands: results on stdout, messages on stderr, one document for ``--json``, and tables."""

from __future__ import annotations

import json
import os
import re
import sys
import textwrap
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from pydantic import BaseModel
    from rich.table import Table

    from schemas.errors import Problem

_FIRM = "\N{NO-BREAK SPACE}"
_QUOTED = re.compile(r"(?:\bpip install )?(?<!\w)'[^']*'(?!\w)")

LONGEST_LINE = 100
SHORTEST_LINE = 20
"""Columns of a line that are always shown, however narrow the terminal is."""

BEFORE_CARET = 0.6
"""Share of `room` before the caret, where a line is too long."""


def say(text: str) -> None:
    """Print a message on stderr; it is never part of the result."""
    typer.echo(text, err=True)


def result(text: str) -> None:
    """Print a part of the result."""
    typer.echo(text)


def document(content: Mapping[str, Any] | BaseModel) -> None:
    """Print the one document of ``--json``."""
    if not isinstance(content, Mapping):
        content = content.model_dump(mode="json")
    # JSON is UTF-8. Other encodings at least include ASCII.
    ascii_only = sys.stdout.encoding.lower().replace("-", "") != "utf8"
    typer.echo(json.dumps(content, indent=2, ensure_ascii=ascii_only, allow_nan=False))


def report(content: Mapping[str, Any] | BaseModel, lines: Iterable[str], *, as_json: bool) -> None:
    """Print a result, as a document or as lines."""
    if as_json:
        document(content)
    else:
        for line in lines:
            result(line)


def table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Collection[str] = (), **options: Any
) -> Table:
    """A table for `show`; columns of `numbers` are right-aligned, `options` are those of a column."""
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD)
    for heading in headings:
        made.add_column(heading, justify="right" if heading in numbers else "left", **options)
    for row in rows:
        made.add_row(*row)
    return made


def show(*things: Table | str, style: str | None = None) -> None:
    """Print tables and lines on a terminal."""
    from rich.console import Console

    # Names in scenes may look like markup.
    console = Console(markup=False, emoji=False, highlight=False)
    for thing in things:
        console.print(thing, style=style)


def emphasis(text: str, color: str | None = None) -> str:
    """Bold text; the emphasis is dropped where the output is not a terminal."""
    return typer.style(text, fg=color, bold=True)


def harmless(text: str) -> str:
    """Replace control characters, which a terminal would act on, by blanks."""
    return "".join(c if c.isprintable() else " " for c in text)


def reached_error(*, estimate: float, low: float, high: float) -> str:
    """The error of a picture with its interval.

    >>> reached_error(estimate=0.0033, low=0.0023, high=0.00406)
    '0.0033 (0.0023 to 0.0041)'
    """
    return f"{estimate:.2g} ({low:.2g} to {high:.2g})"


def columns() -> int | None:
    """Columns of the terminal; None if there is none."""
    asked = os.environ.get("COLUMNS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    for stream in (sys.stderr, sys.stdout):
        try:
            return os.get_terminal_size(stream.fileno()).columns or None
        except (OSError, ValueError):
            continue
    return None


def folded(text: str, *, indent: str = "") -> list[str]:
    """Break a text between words into lines of the terminal; without one it stays a line.

    Quoted words are commands and names: they stay together, to be copied.
    """
    if (room := columns()) is None:
        return [indent + text]
    kept = _QUOTED.sub(lambda words: words[0].replace(" ", _FIRM), text)
    room = max(room, len(indent) + SHORTEST_LINE)
    lines = textwrap.wrap(
        kept,
        room,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_FIRM, " ") for line in lines]


def on_terminal() -> bool:
    """Whether stdout is read by a person and not by a program."""
    return sys.stdout.isatty()


def excerpts(text: bytes, problems: Sequence[Problem], more: int = 0, *, kind: str = "error") -> list[str]:
    """Lines that show each problem.

    Parameters
    ----------
    text
        The document; lines of it are shown where a problem has a line.
    problems, more
        Problems, and the number of further ones.
    kind
        The word before each problem: ``error`` or ``warning``.
    """
    source = text.decode("utf-8-sig", errors="replace").split("\n")
    lines = [line for problem in problems for line in _excerpt(source, problem, kind)]
    return [*lines, f"  ... and {more} more"] if more else lines


def _excerpt(source: Sequence[str], problem: Problem, kind: str) -> Iterable[str]:
    yield f"  {emphasis(kind, 'red' if kind == 'error' else 'yellow')} {_place_of(problem)}"
    yield from folded(harmless(problem.detail), indent="    ")
    if problem.suggestion:
        yield f"    Did you mean {problem.suggestion!r}?"
    if problem.line is not None and problem.column is not None and problem.line <= len(source):
        yield from _marked(source[problem.line - 1], problem.line, problem.column)


def _place_of(problem: Problem) -> str:
    where = emphasis(harmless(problem.pointer) or "(whole document)")
    return where if problem.line is None else f"{where}  line {problem.line}, column {problem.column}"


def _marked(line: str, number: int, column: int) -> Iterable[str]:
    gutter = f"    {number} | "
    room = max(SHORTEST_LINE, min(LONGEST_LINE, (columns() or LONGEST_LINE) - len(gutter)))
    before, after = _window(harmless(line), column - 1, room)
    yield gutter + (before + after).rstrip()
    yield " " * (len(gutter) - 2) + "| " + " " * _cells(before) + emphasis("^", "red")


def _window(line: str, place: int, room: int) -> tuple[str, str]:
    """The part of a line before a place and the part after it, together at most `room` cells."""
    before, after = line[:place], line[place:]
    if _cells(line) > room:
        before = _beginning(before[::-1], int(BEFORE_CARET * room))[::-1]
        after = _beginning(after, room - _cells(before))
    return before, after


def _beginning(text: str, cells: int) -> str:
    """The beginning of a text that fits into `cells` cells; some letters take two."""
    from rich.cells import set_cell_size

    return text if _cells(text[: cells + 1]) <= cells else set_cell_size(text[: cells + 1], cells)


def _cells(text: str) -> int:
    from rich.cells import cell_len

    return cell_len(text)
