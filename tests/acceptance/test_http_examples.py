"""The examples of the HTTP reference, sent to a running service."""

import json
import shutil
from pathlib import Path

import pytest

from tests.acceptance.conftest import Server
from tools.docs import http_examples

pytestmark = pytest.mark.slow


@pytest.mark.skipif(shutil.which("curl") is None, reason="the examples use curl")
def test_every_call_answers_its_example_as_recorded(server: Server, tmp_path: Path) -> None:
    kept = json.loads(http_examples.KEPT.read_text(encoding="utf-8"))
    found = http_examples.answers(server.url, tmp_path)
    different = {call: http_examples.differences(kept[call], answer) for call, answer in found.items()}
    assert {call: what for call, what in different.items() if what} == {}
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "copy.png").read_bytes() == (tmp_path / "picture.png").read_bytes()
