"""From pydantic's errors to findings: the user's places, the user's words, and what was probably meant."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from schemas.base import fields_of
from schemas.errors import SHOWN
from schemas.findings import Finding
from schemas.pointers import Parts, existing, value_at
from schemas.sentences import say
from schemas.unions import MARK, MODELS

_QUOTED = re.compile(r"'([^']*)'")

# Comparing two names costs the product of their lengths, so their length and number are bounded.
_LONGEST_COMPARED = 64
_MOST_COMPARED = 500


def translate(error: ValidationError, model: type[BaseModel], content: object) -> tuple[list[Finding], int]:
    """Translate the first 50 errors and count the others.

    Parameters
    ----------
    error
        What pydantic raised.
    model
        The model that was asked for.
    content
        The document that was validated.
    """
    short, told = _sorted_out(error.errors(include_url=False, include_input=False), content)
    findings = [
        _short_array(location, lacking, content) for location, lacking in islice(short.items(), SHOWN)
    ]
    findings += [_finding(detail, model, content) for detail in told[: SHOWN - len(findings)]]
    return findings, len(short) + len(told) - len(findings)


def _sorted_out(
    details: Iterable[ErrorDetails], content: object
) -> tuple[Counter[Parts], list[ErrorDetails]]:
    """Count the missing entries of each array, and give the other errors as they are."""
    short: Counter[Parts] = Counter()
    told = []
    for detail in details:
        if detail["type"] == "missing" and isinstance(detail["loc"][-1], int):
            short[_untagged(detail["loc"][:-1])] += 1
        # A default that depends on a field which is itself wrong is no mistake of the user's.
        elif detail["type"] != "default_factory_not_called" and not _long_enough(detail, content):
            told.append(detail)
    return short, told


def _long_enough(detail: ErrorDetails, content: object) -> bool:
    """Whether an array that is called too short has entries enough: pydantic counts only the right ones."""
    if detail["type"] != "too_short":
        return False
    array = value_at(content, _untagged(detail["loc"]))
    return isinstance(array, Sequence) and len(array) >= detail["ctx"]["min_length"]


def _short_array(location: Parts, lacking: int, content: object) -> Finding:
    array = value_at(content, location)
    length = len(array) if isinstance(array, Sequence) else 0
    detail = f"This array has too few entries: {length}, where {length + lacking} are needed."
    return Finding(location, "wrong_length", detail)


def _finding(detail: ErrorDetails, model: type[BaseModel], content: object) -> Finding:
    location = _untagged(detail["loc"])
    context = dict(detail.get("ctx", {}))
    match detail["type"]:
        case "missing":
            context["field"] = location[-1]
        case "extra_forbidden":
            return _unknown_field(location, model_at(model, detail["loc"]), content)
        case "unknown_type":
            return _unknown_type(location, detail["msg"], content)
        case "literal_error":
            context["names"] = _QUOTED.findall(context["expected"])
    code, sentence = say(detail["type"], detail["msg"], context)
    suggestion = None
    if "names" in context:
        suggestion = nearest(value_at(content, location), context["names"])
    if location and location[-1] == "[key]" and existing(content, location) != location:
        return Finding(location[:-1], code, sentence, about_key=True)
    return Finding(location, code, sentence, suggestion)


def _untagged(location: Iterable[str | int]) -> Parts:
    return tuple(part for part in location if not (isinstance(part, str) and part.startswith(MARK)))


def _unknown_field(location: Parts, model: type[BaseModel] | None, content: object) -> Finding:
    fields = fields_of(model) if model else []
    code, sentence = say("extra_forbidden", "", {"fields": ", ".join(f"'{name}'" for name in fields)})
    present = value_at(content, location[:-1])
    absent = [name for name in fields if not (isinstance(present, Mapping) and name in present)]
    return Finding(location, code, sentence, nearest(location[-1], absent), about_key=True)


def _unknown_type(location: Parts, message: str, content: object) -> Finding:
    value, (field, *names) = value_at(content, location), _QUOTED.findall(message)
    if not isinstance(value, Mapping):
        return Finding(location, *say("model_type", "", {}))
    if field not in value:
        return Finding(location, "missing_field", message.replace("must be", "is missing. It must be"))
    return Finding((*location, field), f"unknown_{field}", message, nearest(value[field], names))


def model_at(model: type[BaseModel] | None, location: Sequence[str | int]) -> type[BaseModel] | None:
    """Find the model that holds the last part of a location with tags; None where no model does."""
    for part in location[:-1]:
        if isinstance(part, str) and part.startswith(MARK):
            model = MODELS[part]
        elif model is not None and isinstance(part, str):
            field = model.model_fields.get(part)
            model = _model_in(field.annotation) if field else None
    return model


def _model_in(annotation: object) -> type[BaseModel] | None:
    for candidate in (annotation, *get_args(annotation)):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def nearest(written: object, names: Iterable[str]) -> str | None:
    """Give the name that was probably meant, or None.

    >>> nearest("colour", ["center", "color"])
    'color'
    """
    if not isinstance(written, str) or len(written) > _LONGEST_COMPARED:
        return None
    candidates = [name for name in islice(names, _MOST_COMPARED) if len(name) <= _LONGEST_COMPARED]
    same = {name.lower(): name for name in candidates}
    close = difflib.get_close_matches(written.lower(), same, n=1)
    return same[close[0]] if close else None
