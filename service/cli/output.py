"""Where a command's words go: results to stdout, talk to stderr, and one document for ``--json``."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from typing import Annotated, Any

import typer

USUAL_WIDTH = 100
"""Columns where there is no terminal to ask."""

JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else there.")
]


def say(text: str) -> None:
    """Tell the person at the terminal something; never part of the result."""
    typer.echo(text, err=True)


def result(text: str) -> None:
    """Print a part of the result."""
    typer.echo(text)


def document(content: Mapping[str, Any]) -> None:
    """Print the one document of ``--json``."""
    # JSON is UTF-8; what else a stream may be, it knows ASCII.
    ascii_only = sys.stdout.encoding.lower().replace("-", "") != "utf8"
    typer.echo(json.dumps(content, indent=2, ensure_ascii=ascii_only, allow_nan=False))


def emphasis(text: str, color: str | None = None) -> str:
    """Bold text; the emphasis is dropped where the output is not a terminal."""
    return typer.style(text, fg=color, bold=True)


def harmless(text: str) -> str:
    """What a stranger wrote, with a blank for each character that a terminal would act on."""
    return "".join(c if c.isprintable() else " " for c in text)


def reached_error(*, estimate: float, low: float, high: float) -> str:
    """The error of a picture, in words.

    >>> reached_error(estimate=0.0033, low=0.0023, high=0.00406)
    '0.0033 (0.0023 to 0.0041)'
    """
    return f"{estimate:.2g} ({low:.2g} to {high:.2g})"


def width() -> int:
    """Columns of the terminal, and of any other place where lines are read."""
    asked = os.environ.get("COLUMNS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    for stream in (sys.stderr, sys.stdout):
        try:
            return os.get_terminal_size(stream.fileno()).columns or USUAL_WIDTH
        except (OSError, ValueError):
            continue
    return USUAL_WIDTH


def on_terminal() -> bool:
    """Whether stdout is read by a person and not by a program."""
    return sys.stdout.isatty()
