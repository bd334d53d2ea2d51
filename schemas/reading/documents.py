"""Strict reader of JSON text, which refuses what the standard parser accepts or fails on.

Not-a-number, infinities and numbers beyond float64 are not refused here: they become the floats nan and inf,
which no field of the scene language takes, so that they are reported together with everything else.
"""

from __future__ import annotations

import codecs
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from schemas.errors import Problem, SceneError
from schemas.limits import Limits, how_to_raise
from schemas.pointers import Parts
from schemas.reading.file_kinds import SCANNED_BYTES, mistaken
from schemas.reading.findings import Finding, refusal
from schemas.reading.plain import plain
from schemas.reading.positions import Find, line_and_column, locate

# Common mistakes at the position where the parser stops, the most specific first.
_WRITTEN: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"//|/\*|#"), "JSON has no comments. Remove this one."),
    (
        re.compile("[\ufeff\xa0\u2000-\u200b\u2060\u3000]"),
        "There is an unusual space or an invisible character here. Remove it.",
    ),
    (re.compile(r"```"), "Remove this line: it marks code in Markdown and is not JSON."),
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
"""Sentences for the messages of the standard parser."""

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
    if text[offset] in "]}" and (unclosed := _unclosed(text, offset)):
        return unclosed
    if text[offset] in "]}" and _COMMA_BEFORE.search(before):
        return "There is a comma too many before the closing bracket. Remove it."
    if text[offset].isdecimal() and _ZERO_BEFORE.search(before):
        return "A number does not begin with 0, except 0 itself and fractions such as 0.5."
    return next((said for pattern, said in _WRITTEN if pattern.match(text, offset)), None)


def _unclosed(text: str, offset: int) -> str | None:
    """Name the array or object that is still open where a bracket of the other kind closes."""
    opened: list[int] = []
    for match in _BRACKET.finditer(text, 0, offset):
        if match[1] in _OPENING:
            opened.append(match.start(1))
        elif match[1] and opened:
            opened.pop()
    if not opened or text[opened[-1]] + text[offset] in _PAIRS:
        return None
    kind, closing = ("array", "]") if text[opened[-1]] == "[" else ("object", "}")
    line, _ = line_and_column(text, opened[-1])
    return f"The {kind} that begins in line {line} is not closed. Write {closing} before this."


Source = bytes | str | Mapping[str, object]

# Possessive quantifiers: a string of a million escapes must not fill the matcher's stack.
_BRACKET = re.compile(r'(?:[^"\[\]{}]++|"[^"\\]*+(?:\\.[^"\\]*+)*+"?)*+([\[\]{}]|\Z)', re.DOTALL)
"""The next bracket outside of strings, or the end: without it the matcher would try from each character."""
_OPENING = ("[", "{")
_PAIRS = ("[]", "{}")
_ESCAPED_UNFIT = re.compile(r"\\u(?:0000|[dD][89a-fA-F])")
_UNFIT = re.compile("[\x00\ud800-\udfff]")

# An integer with more digits may be larger than the largest float64: it is infinite then, for every field.
_MOST_DIGITS = 308

_TWICE = "This object has the same field more than once. Keep one of them."
_NO_TEXT = "This text has half of a surrogate pair, or the character U+0000. Remove it."
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@dataclass(slots=True)
class Document:
    """A document that was read, with its text where it had one."""

    content: object
    text: str | None
    repeated: list[Finding] = field(default_factory=list)
    """Keys that are repeated in their object."""
    find: Find = locate
    """Positions of the document's places in the text."""


def read_text(source: Source, limits: Limits, *, wanted: str = "a JSON document") -> Document:
    """Parse a document.

    Parameters
    ----------
    source
        Bytes or text of the document, or its parsed content.
    limits
        Limits of its size.
    wanted
        The expected kind, for the message about a file of another one.

    Raises
    ------
    SceneError
        It is too large, not UTF-8, not JSON, or too deeply nested; or it has text that cannot be shown. A
        document made in Python may have arrays and numbers of NumPy, but no other objects unknown to JSON.
    """
    if isinstance(source, Mapping):
        document = Document(plain(source, max_depth=limits.max_depth), None)
        _check_texts(document, limits)
        return document
    try:
        text = _decoded(source, limits)
        _check_nesting(text, limits)
        document = _parsed(text, limits)
    except SceneError as error:
        raise _another_kind(source, wanted) or error from None
    if _ESCAPED_UNFIT.search(text):
        _check_texts(document, limits)
    return document


def _another_kind(source: bytes | str, wanted: str) -> SceneError | None:
    """The error about a file that is not JSON at all; None if it may be meant as JSON."""
    beginning = source[:SCANNED_BYTES]
    content = beginning if isinstance(beginning, bytes) else beginning.encode(errors="replace")
    detail = mistaken(content, wanted)
    return _refused("wrong_file", detail) if detail else None


def _refused(code: str, detail: str, text: str | None = None, offset: int | None = None) -> SceneError:
    if text is None or offset is None:
        return SceneError([Problem(pointer="", detail=detail, code=code)])
    line, column = line_and_column(text, offset)
    return SceneError([Problem(pointer="", detail=detail, code=code, line=line, column=column)])


def _decoded(source: bytes | str, limits: Limits) -> str:
    if len(source) > limits.max_body_bytes:
        raise _refused(
            "too_large",
            f"The document has {len(source)} bytes; at most {limits.max_body_bytes} are allowed. "
            f"{how_to_raise('max_body_bytes')}",
        )
    try:
        # A string is encoded too, so that the same rules apply to both.
        data = source.encode() if isinstance(source, str) else source
    except UnicodeEncodeError:
        raise _refused("not_utf8", "Half of a surrogate pair is here, which is not a character.") from None
    data = data.removeprefix(codecs.BOM_UTF8)
    # JSON begins with an ASCII character, so without a mark UTF-16 has a zero byte in its first two.
    if data.startswith(_UTF_16) or b"\0" in data[:2]:
        raise _refused("not_utf8", "The document is UTF-16, or no text at all. Save it as UTF-8.")
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        before = data[: error.start].decode()
        detail = "The document is not UTF-8 from here on. Save it as UTF-8."
        # The error refers to the bytes, which must not be logged.
        raise _refused("not_utf8", detail, before, len(before)) from None


def _check_nesting(text: str, limits: Limits) -> None:
    """Refuse documents with too deep nesting or too many values, reading only as far as that shows.

    Every value but the first follows a comma, a colon or a bracket, so this bounds all later work.
    """
    if text.count(",") > limits.max_values:
        raise _too_many_values(limits)
    depth = opened = 0
    for match in _BRACKET.finditer(text):
        if match[1] not in _OPENING:
            depth -= 1
            if depth <= 0:
                # The document ends here: the parser refuses what follows.
                return
            continue
        depth += 1
        opened += 1
        if depth > limits.max_depth:
            detail = f"Objects and arrays are nested more than {limits.max_depth} deep."
            raise _refused("too_deep", f"{detail} {how_to_raise('max_depth')}")
        if opened > limits.max_values:
            raise _too_many_values(limits)


def _too_many_values(limits: Limits) -> SceneError:
    detail = f"The document has more than {limits.max_values} values. {how_to_raise('max_values')}"
    return _refused("too_large", detail)


def _parsed(text: str, limits: Limits) -> Document:
    pairs = _Pairs(limits.max_members)
    try:
        content = json.loads(text, object_pairs_hook=pairs.to_dict, parse_int=_integer)
    except json.JSONDecodeError as error:
        raise _not_json(text, error) from None
    document = Document(content, text)
    if pairs.repeated:
        document.repeated = list(pairs.find(content, limits.max_depth))
    return document


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MOST_DIGITS else float(digits)


def _not_json(text: str, error: json.JSONDecodeError) -> SceneError:
    if not text.strip():
        return _refused("empty", "The document is empty. It must be a JSON object.")
    return _refused("not_json", f"This is not JSON. {explain(text, error)}".strip(), text, error.pos)


@dataclass(slots=True)
class _Pairs:
    """Builds objects, and remembers those that have a key twice."""

    most: int
    # The objects are kept, so that no other object gets the identity of a deleted one.
    repeated: dict[int, tuple[dict[str, object], list[str]]] = field(default_factory=dict)

    def to_dict(self, pairs: list[tuple[str, object]]) -> dict[str, object]:
        if len(pairs) > self.most:
            detail = f"An object has {len(pairs)} fields; at most {self.most} are allowed."
            raise _refused("too_large", f"{detail} {how_to_raise('max_members')}")
        built = dict(pairs)
        if len(built) < len(pairs):
            times = Counter(key for key, _ in pairs)
            self.repeated[id(built)] = built, [key for key, count in times.items() if count > 1]
        return built

    def find(self, content: object, depth: int) -> Iterator[Finding]:
        """Find the locations of the objects in the finished document."""
        for parts, node in _nodes(content, depth):
            _, keys = self.repeated.get(id(node), (None, ()))
            for key in keys:
                yield Finding((*parts, key), "duplicate_field", _TWICE, about_key=True)


def _nodes(content: object, depth: int) -> Iterator[tuple[Parts, object]]:
    """Walk through a document, outer before inner, down to `depth`."""
    waiting: list[tuple[Parts, object]] = [((), content)]
    while waiting:
        parts, node = waiting.pop()
        yield parts, node
        if len(parts) > depth:
            continue
        if isinstance(node, Mapping):
            waiting.extend(((*parts, key), value) for key, value in node.items())
        elif isinstance(node, list | tuple):
            waiting.extend(((*parts, index), value) for index, value in enumerate(node))


def _check_texts(document: Document, limits: Limits) -> None:
    """Refuse text that no answer could repeat and no file could hold: half surrogate pairs and U+0000."""
    nodes = _nodes(document.content, limits.max_depth)
    found = [Finding(parts, "not_text", _NO_TEXT) for parts, node in nodes if _unfit(node)]
    # Problems below a key that cannot be shown are reported at the object that has the key.
    found = [finding for finding in found if not any(_unfit(part) for part in finding.location)]
    if found:
        raise refusal(found, document.content, document.text)


def _unfit(node: object) -> bool:
    texts = [node] if isinstance(node, str) else node if isinstance(node, Mapping) else ()
    return any(isinstance(text, str) and _UNFIT.search(text) for text in texts)
