"""Words for what is wrong with the syntax of a JSON text: what stands there, and what belongs there."""

from __future__ import annotations

import json
import re

# What people write at the place where the parser stops, the most specific first.
_WRITTEN: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"//|/\*|#"), "JSON has no comments. Remove this one."),
    (
        re.compile("[\ufeff\xa0\u2000-\u200b\u2060\u3000]"),
        "There is an unusual space or an invisible character here. Remove it.",
    ),
    (re.compile(r"```"), "Remove this line: it marks code in Markdown and is no JSON."),
    (
        re.compile("['`\u2018\u2019\u201c-\u201e\xab]"),
        'Text and field names stand in straight double quotes, like "this".',
    ),
    (re.compile(r"(?:True|TRUE)\b"), "Write true in lower case."),
    (re.compile(r"(?:False|FALSE)\b"), "Write false in lower case."),
    (re.compile(r"(?:None|NULL|Null|nil|undefined)\b"), "Write null for no value."),
    (re.compile(r"(?:nan|inf|infinity)\b", re.IGNORECASE), "A number must be finite."),
    (re.compile(r",\s*[\]}]"), "There is a comma too many before the closing bracket. Remove it."),
    (re.compile(r","), "There is a comma too many. Remove it."),
    (re.compile(r"\+"), "A number has no plus sign. Remove it."),
    (re.compile(r"-?\."), "A number begins with a digit: write 0.5, not .5."),
    (re.compile(r";"), "Values are separated by commas, not semicolons."),
    (re.compile(r"="), "A colon belongs here, between a field name and its value."),
)
_COMMA_BEFORE = re.compile(r",\s*\Z")
_ZERO_BEFORE = re.compile(r"[\[:,\s]-?0\Z")

_EXPECTED = {
    "Expecting property name": "A field name in double quotes belongs here.",
    "Expecting ':'": "A colon belongs here, between a field name and its value.",
    "Expecting ','": "A comma or the closing bracket belongs here.",
    "Expecting value": "A value belongs here: a number, text in double quotes, an array or an object.",
    "Illegal trailing comma": "There is a comma too many before the closing bracket. Remove it.",
    "Extra data": "The document ended before this. Remove what follows.",
    "Unterminated string": "This text has no closing double quote.",
    "Invalid control character": "There is a line break or control character in this text. Write \\n or "
    "\\u00XX in its place.",
    "Invalid \\escape": "There is no such escape. Write a backslash as \\\\.",
    "Invalid \\uXXXX": "Four hexadecimal digits belong after \\u.",
}
"""For each message of the standard parser a sentence."""

_ABOUT_TEXT = ("Unterminated", "Invalid")
_LONGEST_PREFIX = 200


def explain(text: str, error: json.JSONDecodeError) -> str:
    """Give a sentence about the place where the parser stopped, with a cure.

    >>> try:
    ...     json.loads("[1, 2,]")
    ... except json.JSONDecodeError as error:
    ...     print(explain("[1, 2,]", error))
    There is a comma too many before the closing bracket. Remove it.
    """
    if not error.msg.startswith(_ABOUT_TEXT):
        written = _as_written(text, error.pos)
        if written:
            return written
    return next((said for start, said in _EXPECTED.items() if error.msg.startswith(start)), "")


def _as_written(text: str, offset: int) -> str | None:
    if not text[offset:].strip():
        return "The document ends before its last bracket is closed. Is the file cut short?"
    before = text[max(0, offset - _LONGEST_PREFIX) : offset]
    if text[offset] in "]}" and _COMMA_BEFORE.search(before):
        return "There is a comma too many before the closing bracket. Remove it."
    if text[offset].isdecimal() and _ZERO_BEFORE.search(before):
        return "A number does not begin with 0, except 0 itself and fractions such as 0.5."
    return next((said for pattern, said in _WRITTEN if pattern.match(text, offset)), None)
