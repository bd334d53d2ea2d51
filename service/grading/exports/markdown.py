"""A summary in GitHub's Markdown, such as a step of a workflow shows."""

from __future__ import annotations

import re
from pathlib import Path

from schemas.grading.grades import Grade
from service.grading.exports.rows import WORDS, Row, for_students, headline
from service.grading.exports.texts import line, number, shortened

MOST = 1_000_000
"""Bytes: a step that writes more than 1 MiB has no summary at all."""

LENGTHS = (1000, 250)
"""Characters of a message that are tried."""

MEANINGFUL = re.compile(r"([\\`*_{}\[\]()<>#+\-.!|&~@$:^])")
"""What may begin something else than text, addresses and mentions among it."""


def export(grade: Grade, pictures: Path | None = None) -> bytes:
    """A table of all tests. Pictures are left out: GitHub shows none that come without an address."""
    del pictures
    tried = [_summary(grade, for_students(grade), length) for length in LENGTHS]
    return next((content for content in tried if len(content) <= MOST), tried[-1])


def _summary(grade: Grade, rows: tuple[Row, ...], length: int) -> bytes:
    lines = [
        f"## {_plain(grade.title)}",
        "",
        f"**{_plain(headline(grade))}**",
        "",
        "| Test | Points | Result | Why |",
        "| --- | ---: | --- | --- |",
        *(_line(row, length) for row in rows),
    ]
    return "\n".join([*lines, ""]).encode()


def _line(row: Row, length: int) -> str:
    points = f"{number(row.points)} of {number(row.max_points)}"
    why = _plain(shortened(line(row.message), length))
    return f"| {_plain(row.name)} | {'–' if row.open else points} | {WORDS[row.status]} | {why} |"


def _plain(text: str) -> str:
    r"""Text in which no character has a meaning for Markdown or HTML.

    >>> print(_plain("a|b <i> [x](y)"))
    a\|b \<i\> \[x\]\(y\)
    """
    return MEANINGFUL.sub(r"\\\1", line(text))
