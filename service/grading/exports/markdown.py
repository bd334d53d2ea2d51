"""A summary in GitHub's Markdown, for a step of a workflow."""

from __future__ import annotations

import re
from pathlib import Path

from schemas.grading.grades import Grade
from service.grading.exports.rows import Row, for_students, headline
from service.grading.exports.texts import line, shortened

MOST = 1_000_000
"""Bytes: GitHub drops the summary of a step that writes more than 1 MiB."""

LENGTHS = (1000, 250)
"""Lengths to which messages are cut, tried in order until the summary fits."""

MEANINGFUL = re.compile(r"([\\`*_{}\[\]()<>#+\-.!|&~@$:^])")
"""Characters that may start markup, addresses or mentions."""


def export(grade: Grade, _pictures: Path | None = None) -> bytes:
    """Export a table of all tests. Pictures are left out, because GitHub shows only those with an address."""
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
    why = _plain(shortened(line(row.message), length))
    return f"| {_plain(row.name)} | {row.total} | {row.result} | {why} |"


def _plain(text: str) -> str:
    r"""Escape all characters that have a meaning in Markdown or HTML.

    >>> print(_plain("a|b <i> [x](y)"))
    a\|b \<i\> \[x\]\(y\)
    """
    return MEANINGFUL.sub(r"\\\1", line(text))
