"""Words for what is wrong: from the kind of a validation error to a code and a sentence with a cure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from pydantic_core.core_schema import ErrorType

_ARRAY = ("not_an_array", "This must be an array in square brackets, such as [0, 1, 0].")
_OBJECT = ("not_an_object", 'This must be an object in braces, such as {{"name": value}}.')
_NUMBER = ("not_a_number", "This must be a number, such as 1 or 0.5, without quotes.")
_WHOLE = ("not_whole", "This must be a whole number, such as 4, without quotes.")
_TEXT = ("not_text", "This must be text in double quotes.")
_TRUTH = ("not_a_boolean", "This must be true or false, without quotes.")

SENTENCES: dict[str, tuple[str, str]] = {
    "missing": ("missing_field", "The field '{field}' is missing. Add it."),
    "extra_forbidden": ("unknown_field", "This field is not known here. The fields are {fields}."),
    "invalid_key": ("unknown_field", "A field name must be text."),
    "tuple_type": _ARRAY,
    "too_short": ("wrong_length", "This array has too few entries: at least {min_length} are needed."),
    "too_long": ("wrong_length", "This array has too many entries: {max_length} are allowed."),
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
    "string_too_short": (
        "wrong_length",
        "This text is too short: at least {min_length} characters are needed.",
    ),
    "string_too_long": (
        "wrong_length",
        "This text is too long: at most {max_length} characters are allowed.",
    ),
    "literal_error": ("not_a_choice", "This must be {expected}."),
    "greater_than": ("out_of_range", "This must be more than {gt:.16g}."),
    "greater_than_equal": ("out_of_range", "This must be {ge:.16g} or more."),
    "less_than": ("out_of_range", "This must be less than {lt:.16g}."),
    "less_than_equal": ("out_of_range", "This must be {le:.16g} or less."),
}
"""For each of pydantic's error types that the scene language can cause: a code and a sentence."""

OTHERWISE = ("unusable", "This value cannot be used here. See the description of the field.")

BUILT_IN: frozenset[str] = frozenset(get_args(ErrorType))
"""The error types that pydantic has words for."""


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
    if kind in SENTENCES:
        code, sentence = SENTENCES[kind]
        return code, sentence.format_map(context)
    return OTHERWISE if kind in BUILT_IN else (kind, message)
