"""Mistakes in the syntax of JSON are named, with their cure."""

import pytest

from schemas.errors import SceneError
from schemas.reading import read_scene

WRITTEN: dict[str, tuple[str, int, str]] = {
    "line comment": ('{"a": 1 // one\n}', 9, "JSON has no comments. Remove this one."),
    "block comment": ("/* scene */ {}", 1, "JSON has no comments. Remove this one."),
    "hash comment": ('{"a": [1, # one\n2]}', 11, "JSON has no comments. Remove this one."),
    "trailing comma": (
        '{"a": [1, 2, ]}',
        14,
        "There is a comma too many before the closing bracket. Remove it.",
    ),
    "trailing comma of an object": ('{"a": 1,}', 9, "There is a comma too many before the closing bracket."),
    "an open array": ('{"a": [\n1, "]", [],\n}', 1, "The array that begins in line 1 is not closed. Write ]"),
    "an open object": ('[{"a": 1]', 9, "The object that begins in line 1 is not closed. Write } before"),
    "two commas": ("[1,,2]", 4, "There is a comma too many. Remove it."),
    "single quotes": ("{'a': 1}", 2, "Text and field names stand in straight double quotes"),
    "typographic quotes": ("{\u201ca\u201d: 1}", 2, "Text and field names stand in straight double quotes"),
    "a bare name": ("{a: 1}", 2, "A field name in double quotes belongs here."),
    "Python's true": ('{"a": True}', 7, "Write true in lower case."),
    "Python's false": ('{"a": False}', 7, "Write false in lower case."),
    "Python's none": ('{"a": None}', 7, "Write null for no value."),
    "a plus sign": ('{"a": +1}', 7, "A number has no plus sign. Remove it."),
    "no leading digit": ('{"a": .5}', 7, "A number begins with a digit: write 0.5, not .5."),
    "no leading digit after a sign": ('{"a": -.5}', 7, "A number begins with a digit: write 0.5, not .5."),
    "a leading zero": ('{"a": 01}', 8, "A number does not begin with 0"),
    "an unknown number": ('{"a": nan}', 7, "A number must be finite."),
    "a semicolon": ('{"a": 1; "b": 2}', 8, "Values are separated by commas, not semicolons."),
    "an equals sign": ('{"a" = 1}', 6, "A colon belongs here"),
    "Markdown": ("```json\n{}\n```", 1, "Remove this line: it marks code in Markdown"),
    "the end": ('{"a": [1, 2', 12, "The document ends before its last bracket is closed."),
    "an open text": ('{"a": "x}', 7, "This text has no closing double quote."),
    "a no-break space": ('{"a":\u00a01}', 6, "There is an unusual space or an invisible character here."),
    "a second byte order mark": ("\ufeff\ufeff{}", 1, "There is an unusual space or an invisible character"),
    "YAML": ("version: 1\n", 1, "A value belongs here: a number, text in double quotes"),
    "two documents": ("{} {}", 4, "The document ended before this. Remove what follows."),
    "a backslash": ('{"a": "C:\\x"}', 10, "There is no such escape. Write a backslash as \\\\."),
}


@pytest.mark.parametrize(("text", "column", "sentence"), WRITTEN.values(), ids=WRITTEN)
def test_mistake_is_named_at_its_place(text: str, column: int, sentence: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(text)
    (problem,) = caught.value.errors
    assert problem.code == "not_json"
    assert problem.detail.startswith(f"This is not JSON. {sentence}")
    # Newer versions of Python point to the comma itself, older ones behind it.
    assert problem.column is not None
    assert abs(problem.column - column) <= ("comma" in sentence) * 2


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_is_named(encoding: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene('{"version": 1}'.encode(encoding))
    (problem,) = caught.value.errors
    assert (problem.code, problem.detail.split(",")[0]) == ("not_utf8", "The document is UTF-16")
