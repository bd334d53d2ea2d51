"""Where in the user's own text a problem lies."""

from __future__ import annotations

from collections.abc import Iterable

from schemas.pointers import Parts
from schemas.positions import line_and_column, locate
from schemas.problems import Problem


def located(text: str | None, problems: Iterable[Problem]) -> list[Problem]:
    """The same problems with line and column.

    Parameters
    ----------
    text
        The JSON text that the pointers point into; without one, problems stay as they are.
    """
    problems = list(problems)
    if text is None:
        return problems
    places = locate(text, [_parts(problem.pointer) for problem in problems])
    return [
        _at(problem, *line_and_column(text, places[_parts(problem.pointer)].value)) for problem in problems
    ]


def _at(problem: Problem, line: int, column: int) -> Problem:
    return problem.model_copy(update={"line": line, "column": column})


def _parts(pointer: str) -> Parts:
    return tuple(step.replace("~1", "/").replace("~0", "~") for step in pointer.split("/")[1:])
