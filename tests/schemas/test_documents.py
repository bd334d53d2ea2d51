"""Bytes that are not a usable document are refused cleanly, whatever they are."""

import contextlib
import json
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from schemas.errors import Problem, SceneError
from schemas.limits import Limits
from schemas.reading import read_scene


def refusal(data: bytes | str, limits: Limits | None = None) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        read_scene(data, limits=limits or Limits())
    for problem in caught.value.errors:
        problem.model_dump_json().encode()
    return list(caught.value.errors)


@given(data=st.binary() | st.text().map(str.encode) | st.text('[]{},:"\\u0123456789eE+-. \n').map(str.encode))
@example(b"[" * 100_000)
@example(b'{"a":' * 100_000)
@example(b"\xef\xbb\xbf")
@example(b"\xef\xbb\xbf\xff")
@example(b"\xff\xfe{\x00}\x00")
@example(b'"\\ud800"')
@example(b"9" * 5000)
@example(b'{"version": ' + b"9" * 5000 + b"}")
@example(b"1e400")
@example(b"NaN")
@example(b'{"\\ud800": 1, "version": NaN}')
@example(b'{"\\u0000Triangle": 1}')
def test_arbitrary_bytes_are_refused(data: bytes) -> None:
    assert refusal(data)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_scene_is_read_or_refused(scene: dict[str, Any], data: st.DataObject) -> None:
    text = bytearray(json.dumps(scene).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        position = data.draw(st.integers(0, len(text) - 1))
        text[position : position + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    with contextlib.suppress(SceneError):
        read, _ = read_scene(bytes(text))
        assert read.version == 1


@pytest.mark.parametrize(
    ("text", "code", "line", "column"),
    [
        ("", "empty", None, None),
        (" \n", "empty", None, None),
        ('{"version": 1,\r\n "camera" {}}', "not_json", 2, 11),
        ('{"version": 1} {}', "not_json", 1, 16),
        ('{"version": 1\n', "not_json", 2, 1),
        ('{"name": "\N{PERFORMING ARTS}", x}', "not_json", 1, 15),
        ('{"name": "a\nb"}', "not_json", 1, 12),
    ],
)
def test_syntax_error_has_its_place(text: str, code: str, line: int | None, column: int | None) -> None:
    (problem,) = refusal(text.encode())
    assert (problem.pointer, problem.code, problem.line, problem.column) == ("", code, line, column)


def test_invalid_utf8_has_its_place() -> None:
    for mark in (b"", b"\xef\xbb\xbf"):
        (problem,) = refusal(mark + '{\n "name": "ü'.encode() + b"\xfc" + b'"}')
        assert (problem.code, problem.line, problem.column) == ("not_utf8", 2, 12)


def test_byte_order_mark_is_skipped(scene: dict[str, Any]) -> None:
    assert read_scene(b"\xef\xbb\xbf" + json.dumps(scene).encode()) == read_scene(scene)


def test_repeated_field_is_refused(scene: dict[str, Any]) -> None:
    text = json.dumps(scene).replace('"version": 1', '"version": 1, "version": 1')
    (problem,) = refusal(text)
    assert (problem.pointer, problem.code, problem.column) == ("/version", "duplicate_field", 16)


@pytest.mark.parametrize(
    "written", ["NaN", "Infinity", "-Infinity", "1e400", "-1e400", "9" * 309, "9" * 310, "9" * 5000]
)
def test_number_that_is_not_finite(scene: dict[str, Any], written: str) -> None:
    scene["camera"]["position"][1] = "here"
    (problem,) = refusal(json.dumps(scene).replace('"here"', written))
    assert (problem.pointer, problem.code) == ("/camera/position/1", "not_finite")


def test_lone_surrogate_is_refused(scene: dict[str, Any]) -> None:
    scene["shapes"][0]["name"] = "here"
    (problem,) = refusal(json.dumps(scene).replace("here", "\\uD83C"))
    assert (problem.pointer, problem.code) == ("/shapes/0/name", "not_text")


@pytest.mark.parametrize(
    ("limits", "data"),
    [
        (Limits(max_body_bytes=9), b'{"a": 123}'),
        (Limits(max_values=3), b"[1, 2, 3, 4, 5]"),
        (Limits(max_values=3), b"[[[[1]]]]"),
        (Limits(max_members=1), b'{"a": 1, "b": 2}'),
    ],
)
def test_document_beyond_a_limit(limits: Limits, data: bytes) -> None:
    (problem,) = refusal(data, limits)
    assert problem.code == "too_large"


def test_repeated_field_inside_a_repeated_one() -> None:
    text = '{"camera": {"up": 1, "up": 2}, "camera": {"width": 1}}'
    twice = [problem.pointer for problem in refusal(text) if problem.code == "duplicate_field"]
    assert twice == ["/camera"]


def test_surrogate_pair_is_a_character(scene: dict[str, Any]) -> None:
    scene["name"] = "\N{PERFORMING ARTS}"
    assert read_scene(json.dumps(scene))[0].name == "\N{PERFORMING ARTS}"
