"""One report for one mistake: errors of validation that have a common cause become one.

Pydantic reports each field by itself. A misspelt field is both missing and unknown; an object that gives no
form of its type lacks all fields of the first; an array of text has as many wrong entries as it has entries.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from schemas.base import FORMS, deciding_fields, form_with, model_at

Location = tuple[str | int, ...]
Suggest = Callable[[Location, str], str | None]
"""Gives the field that was probably meant by an unknown one of an object, both as pydantic locates them."""

FOLLOWS_FROM = {
    "unknown_material": ("materials", 3),
    "unknown_texture": ("textures", 3),
    "not_square": ("pattern", 1),
}
"""Errors that a misspelt field causes elsewhere: which field, and how many levels above the error it is."""


_SUGGESTED = {"literal_error", "unknown_type"}
"""Errors with a suggestion of their own for each value."""


class Merged(NamedTuple):
    """An error that stands for others.

    Attributes
    ----------
    detail
        The first of them.
    others
        Number of further entries of the same array with the same error.
    """

    detail: ErrorDetails
    others: int = 0


def merge(details: Sequence[ErrorDetails], model: type[BaseModel], suggest: Suggest) -> list[Merged]:
    """Leave out every error that another one explains.

    Parameters
    ----------
    details
        Pydantic's errors, in their order.
    model
        The requested model.
    suggest
        Finds misspelt fields.
    """
    explained = _explained_by_misspelling(details, model, suggest)
    explained |= _without_a_form(details, model) | _of_another_form(details, model)
    return _without_repetition(detail for number, detail in enumerate(details) if number not in explained)


def _without_repetition(details: Iterable[ErrorDetails]) -> list[Merged]:
    """The same error of several entries of one array, at the first of them."""
    first: list[ErrorDetails] = []
    seen: dict[object, int] = {}
    others: Counter[int] = Counter()
    for detail in details:
        place = detail["loc"]
        if place and isinstance(place[-1], int) and detail["type"] not in _SUGGESTED:
            number = seen.setdefault((place[:-1], detail["type"], detail["msg"]), len(first))
            if number < len(first):
                others[number] += 1
                continue
        first.append(detail)
    return [Merged(detail, others[number]) for number, detail in enumerate(first)]


def _explained_by_misspelling(
    details: Sequence[ErrorDetails], model: type[BaseModel], suggest: Suggest
) -> set[int]:
    """Indices of errors that say "missing" of a field or name that is only misspelt."""
    unknown: dict[Location, list[str]] = defaultdict(list)
    missing: dict[Location, list[int]] = defaultdict(list)
    for number, detail in enumerate(details):
        kind, place = detail["type"], detail["loc"]
        if kind == "extra_forbidden":
            unknown[place[:-1]].append(str(place[-1]))
        elif kind == "missing":
            missing[place[:-1]].append(number)
        elif kind in FOLLOWS_FROM:
            missing[place[: -FOLLOWS_FROM[kind][1]]].append(number)
    explained: set[int] = set()
    for parent in (parent for parent in unknown if parent in missing):
        meant = {suggest(parent, name) for name in unknown[parent]}
        explained |= {number for number in missing[parent] if _is_meant(details[number], model, meant)}
    return explained


def _without_a_form(details: Sequence[ErrorDetails], model: type[BaseModel]) -> set[int]:
    """Indices of repeated errors: an object that chooses no form of its type needs only one."""
    missing: dict[Location, dict[str | int, int]] = defaultdict(dict)
    for number, detail in enumerate(details):
        if detail["type"] == "missing":
            missing[detail["loc"][:-1]][detail["loc"][-1]] = number
    explained: set[int] = set()
    for parent, fields in missing.items():
        form = model_at(model, (*parent, ""))
        deciding = deciding_fields(form) if form else ()
        if all(field in fields for field in deciding):
            explained |= {fields[field] for field in deciding[1:]}
    return explained


def _of_another_form(details: Sequence[ErrorDetails], model: type[BaseModel]) -> set[int]:
    """Indices of repeated errors: an object that mixes the fields of two forms needs only one."""
    mixed: set[Location] = set()
    explained: set[int] = set()
    for number, detail in enumerate(details):
        place = detail["loc"]
        if detail["type"] == "extra_forbidden" and form_with(str(place[-1]), model_at(model, place)):
            explained |= {number} if place[:-1] in mixed else set()
            mixed.add(place[:-1])
    return explained


def _is_meant(detail: ErrorDetails, model: type[BaseModel], meant: set[str | None]) -> bool:
    """Whether a missing field is there under another name, or belongs to a form that was not meant."""
    field, _ = FOLLOWS_FROM.get(detail["type"], (detail["loc"][-1], 0))
    form = model_at(model, detail["loc"])
    if field in meant or form is None:
        return field in meant
    decides = field in deciding_fields(form)
    return decides and any(
        meant & {*deciding_fields(other)} for other in FORMS.get(form, ()) if other is not form
    )
