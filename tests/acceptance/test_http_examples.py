"""The examples of the HTTP reference, sent to a running service."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.acceptance.conftest import Server
from tools.docs import http_examples

pytestmark = pytest.mark.slow


@pytest.mark.skipif(shutil.which("curl") is None, reason="the examples use curl")
def test_every_call_answers_its_example_as_recorded(server: Server, tmp_path: Path) -> None:
    kept = http_examples.kept()
    found = http_examples.answers(server.url, tmp_path)
    different = {call: differences(kept[call], answer) for call, answer in found.items()}
    assert {call: what for call, what in different.items() if what} == {}
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "copy.png").read_bytes() == (tmp_path / "picture.png").read_bytes()


def differences(kept: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """How the response of a call differs from the kept one: in its status, its headers, or its fields."""
    compared = {
        f"status {found['status']}": kept["status"] == found["status"],
        f"headers {sorted(found['headers'])}": kept["headers"].keys() == found["headers"].keys(),
        f"shape {found['shape']}": has_shape(kept["shape"], found["shape"]),
    }
    return [what for what, same in compared.items() if not same]


def has_shape(kept: Any, found: Any) -> bool:
    """Whether two shapes agree. What is null or empty in one of them may be anything in the other.

    >>> has_shape({"jobs": [], "error": None}, {"jobs": [{"id": "text"}], "error": {"low": "number"}})
    True
    >>> has_shape({"jobs": [{"id": "text"}]}, {"jobs": [{"id": "number"}]})
    False
    >>> has_shape({"id": "text"}, {"id": "text", "name": "text"})
    False
    """
    if kept in (None, []) or found in (None, []):
        return True
    if isinstance(kept, dict) and isinstance(found, dict):
        return kept.keys() == found.keys() and all(has_shape(kept[name], found[name]) for name in kept)
    if isinstance(kept, list) and isinstance(found, list):
        return has_shape(kept[0], found[0])
    return bool(kept == found)
