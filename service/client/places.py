"""Where in the user's own text a problem lies."""

from __future__ import annotations

from collections.abc import Iterable

from schemas.pointers import tokens
from schemas.positions import Place, line_and_column, locate
from schemas.problems import Problem

ABOUT_THE_KEY = frozenset({"unknown_field"})
"""Problems that stand at the name of a field and not at its value."""


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
    locations = [tokens(problem.pointer) for problem in problems]
    places = locate(text, locations)
    return [
        _at(problem, *line_and_column(text, _offset(problem, places[parts])))
        for problem, parts in zip(problems, locations, strict=True)
    ]


def _offset(problem: Problem, place: Place) -> int:
    return place.keys[0] if problem.code in ABOUT_THE_KEY and place.keys else place.value


def _at(problem: Problem, line: int, column: int) -> Problem:
    return problem.model_copy(update={"line": line, "column": column})
