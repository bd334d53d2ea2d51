"""Translation of validation errors into problems: location, a sentence with a cure, and a suggestion."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Sized
from itertools import islice
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from schemas.base import FORMS, deciding_fields, fields_of, form_with, member, model_at, untagged
from schemas.errors import BUILT_IN, MAX_LISTED
from schemas.pointers import Parts, existing, value_at
from schemas.quantities import MIN_SIZE
from schemas.reading.findings import Finding
from schemas.reading.merging import FOLLOWS_FROM, Merged, merge

_ARRAY = ("not_an_array", "This must be an array in square brackets, such as [0, 1, 0].")
_OBJECT = ("not_an_object", 'This must be an object in braces, such as {{"name": value}}.')
_NUMBER = ("not_a_number", "This must be a number, such as 1 or 0.5, without quotes.")
_WHOLE = ("not_whole", "This must be a whole number, such as 4, without quotes.")
_TEXT = ("not_text", "This must be text in double quotes.")
_TRUTH = ("not_a_boolean", "This must be true or false, without quotes.")

# Users who give a size of 0 expect "more than 0"; the true bound is that below which squares vanish.
_MORE_THAN_0 = ("out_of_range", f"This must be more than 0: {MIN_SIZE:g} or more.")
_EMPTY = ("wrong_length", "This text must not be empty.")

SENTENCES: dict[str, tuple[str, str]] = {
    "missing": ("missing_field", "The field '{field}' is missing. Add it."),
    "extra_forbidden": ("unknown_field", "There is no such field here."),
    "invalid_key": ("unknown_field", "A field name must be text."),
    "tuple_type": _ARRAY,
    "too_short": ("wrong_length", "This has {actual_length} entries; at least {min_length} are needed."),
    "too_long": ("wrong_length", "This has {actual_length} entries; at most {max_length} are allowed."),
    "dict_type": _OBJECT,
    "model_type": _OBJECT,
    "model_attributes_type": _OBJECT,
    "float_type": _NUMBER,
    "finite_number": ("not_finite", "This must be a finite number: not NaN, not Infinity, at most 1.8e308."),
    "int_type": _WHOLE,
    "int_from_float": _WHOLE,
    "int_parsing_size": ("out_of_range", "This whole number is too large."),
    "bool_type": _TRUTH,
    "bool_parsing": _TRUTH,
    "string_type": _TEXT,
    "string_unicode": _TEXT,
    "string_too_short": ("wrong_length", "This text is too short: it needs {min_length} or more characters."),
    "string_too_long": (
        "wrong_length",
        "This text is too long: it may have {max_length} characters at most.",
    ),
    "enum": ("not_a_choice", "This must be {expected}."),
    "literal_error": ("not_a_choice", "This must be {expected}."),
    "greater_than": ("out_of_range", "This must be more than {gt}."),
    "greater_than_equal": ("out_of_range", "This must be at least {ge}."),
    "less_than": ("out_of_range", "This must be less than {lt}."),
    "less_than_equal": ("out_of_range", "This must be at most {le}."),
}
"""Code and sentence for each of pydantic's error types that the scene language can cause."""

OTHERWISE = ("unusable", "This value cannot be used here. See the description of the field.")


def say(kind: str, message: str, context: Mapping[str, Any]) -> tuple[str, str]:
    """Give code and sentence for a validation error.

    Parameters
    ----------
    kind
        The error's type. Types that are not pydantic's own come from validators of this package.
    message
        The error's own message; it is used for the latter only.
    context
        Values for the sentence: bounds and names, never what the user wrote.
    """
    if context.get("ge") == MIN_SIZE:
        return _MORE_THAN_0
    if context.get("min_length") == 1 and kind == "string_too_short":
        return _EMPTY
    if kind in SENTENCES:
        code, sentence = SENTENCES[kind]
        return code, sentence.format_map({name: _written(value) for name, value in context.items()})
    return OTHERWISE if kind in BUILT_IN else (kind, message)


def _written(value: object) -> object:
    """A bound as people write it: 180 and 1e15, not 180.0 and 1000000000000000.

    >>> [_written(bound) for bound in (180.0, -1e15, 1e-6, 0.5, 1 << 53)]
    ['180', '-1e15', '1e-6', '0.5', 9007199254740992]
    """
    return f"{value:g}".replace("e+", "e").replace("e-0", "e-") if isinstance(value, float) else value


_COLOR = "A colour is an array of three linear numbers: [1, 0, 0] is red. Codes such as #ff0000 are not read."
_COLOR_CODE = re.compile(r"#[0-9a-fA-F]{3,8}")
_QUOTED = re.compile(r"'([^']*)'")

# Comparing two names costs the product of their lengths, so their length and number are bounded.
_LONGEST_COMPARED = 64
_MOST_COMPARED = 500
# No more fields of a document are compared with those that are missing: a twentieth of a second.
_MOST_MISSPELT = 200

# A shorter word is part of too many names.
_SHORTEST_PART = 3
_SYNONYMS = {"sphere": "ellipsoid"}


def translate(error: ValidationError, model: type[BaseModel], content: object) -> tuple[list[Finding], int]:
    """Translate the first 50 errors and count the others.

    Parameters
    ----------
    error
        The error of pydantic.
    model
        The requested model.
    content
        The document that was validated.
    """
    details = error.errors(include_url=False, include_input=False)
    short, others = _sorted_out(details, content)
    budget = iter(range(_MOST_MISSPELT))

    def suggest(parent: Sequence[str | int], name: str) -> str | None:
        return _suggested(parent, name, model, content) if next(budget, None) is not None else None

    merged = merge(others, model, suggest)
    findings = [
        _short_array(location, lacking, content) for location, lacking in islice(short.items(), MAX_LISTED)
    ]
    findings += [_finding(each, model, content) for each in merged[: MAX_LISTED - len(findings)]]
    return findings, len(short) + len(merged) - len(findings)


def _sorted_out(
    details: Iterable[ErrorDetails], content: object
) -> tuple[Counter[Parts], list[ErrorDetails]]:
    """Count the missing entries of each array, and give the other errors as they are."""
    short: Counter[Parts] = Counter()
    others = []
    for detail in details:
        if detail["type"] == "missing" and isinstance(detail["loc"][-1], int):
            short[untagged(detail["loc"][:-1])] += 1
        # A default that depends on a field which is itself wrong is no mistake of the user's.
        elif detail["type"] != "default_factory_not_called" and not _long_enough(detail, content):
            others.append(detail)
    return short, others


def _long_enough(detail: ErrorDetails, content: object) -> bool:
    """Whether an array that is called too short has entries enough: pydantic counts only the right ones."""
    if detail["type"] != "too_short":
        return False
    array = value_at(content, untagged(detail["loc"]))
    return isinstance(array, Sequence) and len(array) >= detail["ctx"]["min_length"]


def _short_array(location: Parts, lacking: int, content: object) -> Finding:
    array = value_at(content, location)
    length = len(array) if isinstance(array, Sequence) else 0
    entries = "1 entry" if length == 1 else f"{length} entries"
    return Finding(
        location, "wrong_length", f"This array has {entries}, where {length + lacking} are needed."
    )


def _finding(merged: Merged, model: type[BaseModel], content: object) -> Finding:
    detail, others = merged
    location = untagged(detail["loc"])
    match detail["type"]:
        case "missing":
            return _missing_field(location, model_at(model, detail["loc"]), content)
        case "extra_forbidden":
            return _unknown_field(location, model_at(model, detail["loc"]), content)
        case "unknown_type":
            return _unknown_type(location, detail["msg"], content)
        case "tuple_type" if _is_color_code(value_at(content, location)):
            return Finding(location, "not_an_array", _COLOR)
    context = _context(detail, location, content)
    code, sentence = say(detail["type"], detail["msg"], context)
    if others:
        sentence += (
            f" The same is true of {others} more {'entry' if others == 1 else 'entries'} of this array."
        )
    suggestion = None
    if "names" in context:
        suggestion = nearest(value_at(content, location), context["names"])
    if location and location[-1] == "[key]" and existing(content, location) != location:
        return Finding(location[:-1], code, sentence, about_key=True)
    return Finding(location, code, sentence, suggestion)


def _context(detail: ErrorDetails, location: Parts, content: object) -> dict[str, Any]:
    """The values for a sentence, and the names of which one was probably meant."""
    context = dict(detail.get("ctx", {}))
    match detail["type"]:
        case "literal_error":
            context["names"] = _QUOTED.findall(context["expected"])
        case "unknown_material" | "unknown_texture" as kind:
            field, levels = FOLLOWS_FROM[kind]
            context["names"] = member(value_at(content, location[:-levels]), field) or ()
        case "too_short" | "too_long" if isinstance(given := value_at(content, location), Sized):
            # Pydantic leaves the length of an object open where it stops at its limit.
            context["actual_length"] = len(given)
    return context


def _is_color_code(value: object) -> bool:
    return isinstance(value, str) and _COLOR_CODE.fullmatch(value) is not None


def _missing_field(location: Parts, model: type[BaseModel] | None, content: object) -> Finding:
    code, sentence = say("missing", "", {"field": location[-1]})
    deciding = [deciding_fields(form) for form in FORMS.get(model, ())] if model else []
    present = value_at(content, location[:-1])
    if len(deciding) > 1 and not any(_has(present, field) for fields in deciding for field in fields):
        offer = ", or ".join(_listed(fields) for fields in deciding)
        sentence = f"Fields are missing: add {offer}."
    return Finding(location, code, sentence)


def _unknown_field(location: Parts, model: type[BaseModel] | None, content: object) -> Finding:
    code, sentence = say("extra_forbidden", "", {})
    other = form_with(str(location[-1]), model)
    if model and other:
        ours, theirs = _listed(deciding_fields(model)), _listed(deciding_fields(other))
        sentence = f"This field goes with {theirs}, not with {ours}. Remove it."
        if location[-1] in deciding_fields(other):
            sentence = f"Give {theirs}, or {ours}, but not both."
        return Finding(location, code, sentence, about_key=True)
    suggestion = _nearest_field(location[-1], model, value_at(content, location[:-1]))
    if not suggestion:
        sentence += " The fields are " + ", ".join(f"'{name}'" for name in _fields_of_forms(model)) + "."
    return Finding(location, code, sentence, suggestion, about_key=True)


def _suggested(parent: Sequence[str | int], name: str, model: type[BaseModel], content: object) -> str | None:
    return _nearest_field(name, model_at(model, (*parent, name)), value_at(content, untagged(parent)))


def _nearest_field(name: object, model: type[BaseModel] | None, present: object) -> str | None:
    """The field that an object lacks and that was probably meant, in whichever form of its type."""
    return nearest(name, [field for field in _fields_of_forms(model) if not _has(present, field)])


def _fields_of_forms(model: type[BaseModel] | None) -> list[str]:
    """The fields of all forms of a type, those of the given one first."""
    forms = (model, *FORMS.get(model, ())) if model else ()
    return list(dict.fromkeys(field for form in forms for field in fields_of(form)))


def _has(present: object, field: str) -> bool:
    return isinstance(present, Mapping) and field in present


def _listed(names: Sequence[str]) -> str:
    *most, last = (f"'{name}'" for name in names)
    return f"{', '.join(most)} and {last}" if most else last


def _unknown_type(location: Parts, message: str, content: object) -> Finding:
    value, (field, *names) = value_at(content, location), _QUOTED.findall(message)
    if not isinstance(value, Mapping):
        return Finding(location, *say("model_type", "", {}))
    if field not in value:
        return Finding(location, "missing_field", message.replace("must be", "is missing. It must be"))
    return Finding((*location, field), f"unknown_{field}", message, nearest(value[field], names))


def nearest(written: object, names: Iterable[str]) -> str | None:
    """Give the name that was probably meant, or None.

    >>> nearest("colour", ["center", "color"]), nearest("fov", ["position", "vertical_fov"])
    ('color', 'vertical_fov')
    """
    if not isinstance(written, str) or len(written) > _LONGEST_COMPARED:
        return None
    candidates = [name for name in islice(names, _MOST_COMPARED) if len(name) <= _LONGEST_COMPARED]
    same = {name.lower(): name for name in candidates}
    word = _SYNONYMS.get(written.lower(), written.lower())
    if word in same:
        return same[word]
    holders = [name for name in same if len(word) >= _SHORTEST_PART and word in name.split("_")]
    close = holders if len(holders) == 1 else difflib.get_close_matches(word, same, n=1)
    return same[close[0]] if close else None
