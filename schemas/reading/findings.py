"""Findings of reading, and their translation into problems with positions in the user's text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from schemas.errors import MAX_LISTED, Problem, SceneError
from schemas.pointers import Parts, existing, pointer, tokens
from schemas.reading.positions import Find, Place, line_and_column, locate

ABOUT_THE_KEY = frozenset({"unknown_field"})
"""Codes of problems that stand at the name of a field and not at its value."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something to report about one location of a document.

    The location may go further than the document does: the problem then names the last part that is there.
    """

    location: Parts
    code: str
    detail: str
    suggestion: str | None = None
    about_key: bool = False
    """Whether the key is meant, not the value after it."""


def show(
    findings: Sequence[Finding], content: object, text: str | None, find: Find = locate
) -> tuple[Problem, ...]:
    """Give the first 50 findings their pointers, lines and columns, in the order of the document.

    Parameters
    ----------
    findings
        Findings, the most important first.
    content
        The parsed document.
    text
        The document as it was written; None if it never was text, then there are no lines.
    find
        Finds places in such a text.
    """
    first = findings[:MAX_LISTED]
    locations = [existing(content, finding.location) for finding in first]
    problems = [_problem(finding, parts) for finding, parts in zip(first, locations, strict=True)]
    if text is None:
        return tuple(problems)
    positions = find(text, locations)
    offsets = [
        _offset(positions[parts], finding, parts) for finding, parts in zip(first, locations, strict=True)
    ]
    order = sorted(range(len(first)), key=offsets.__getitem__)
    return tuple(_placed(problems[index], text, offsets[index]) for index in order)


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
    positions = locate(text, locations)
    return [
        _placed(problem, text, _start(problem, positions[parts]))
        for problem, parts in zip(problems, locations, strict=True)
    ]


def refusal(
    findings: Sequence[Finding], content: object, text: str | None, more: int = 0, find: Find = locate
) -> SceneError:
    """Make the error that reports all findings; `more` counts those that are not among them."""
    return SceneError(show(findings, content, text, find), more=more + max(0, len(findings) - MAX_LISTED))


def _problem(finding: Finding, parts: Parts) -> Problem:
    return Problem(
        pointer=pointer(parts), detail=finding.detail, code=finding.code, suggestion=finding.suggestion
    )


def _offset(place: Place, finding: Finding, parts: Parts) -> int:
    if not (finding.about_key and place.keys and parts == finding.location):
        return place.value
    # Of a repeated key the second one is reported; a key that is there once has no second.
    return place.keys[min(1, len(place.keys) - 1)]


def _start(problem: Problem, place: Place) -> int:
    return place.keys[0] if problem.code in ABOUT_THE_KEY and place.keys else place.value


def _placed(problem: Problem, text: str, offset: int) -> Problem:
    line, column = line_and_column(text, offset)
    return problem.model_copy(update={"line": line, "column": column})
