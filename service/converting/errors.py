"""Exceptions of the converters.

ValueError
├── ConversionError    a file breaks the rules of its format; with every problem
└── FileAwayError      a file that another one names is not there, or may not be read
"""

from __future__ import annotations

from collections.abc import Sequence

from schemas.errors import Problem


class ConversionError(ValueError):
    """A file cannot be converted.

    Parameters
    ----------
    name
        The file as the user named it.
    text
        Its content, of which lines are shown; empty if it is not text.
    problems
        Problems: pointers of JSON, lines of OBJ and MTL.
    more
        Number of further problems.
    """

    def __init__(self, name: str, text: bytes, problems: Sequence[Problem], more: int = 0) -> None:
        super().__init__(f"{name} cannot be converted: {problems[0].detail}")
        self.name = name
        self.text = text
        self.problems = tuple(problems)
        self.more = more


class FileAwayError(ValueError):
    """A file that another one names cannot be read; the message gives the reason and the cure."""


def wrong_at_line(name: str, text: bytes, line: int, detail: str) -> ConversionError:
    """The error about one line of a text file."""
    problem = Problem(pointer="", detail=detail, code="unusable_line", line=line, column=1)
    return ConversionError(name, text, [problem])


def wrong_at(name: str, pointer: str, detail: str) -> ConversionError:
    """The error about one place of a JSON document; its line is found later."""
    problem = Problem(pointer=pointer, detail=detail, code="unusable_value")
    return ConversionError(name, b"", [problem])
