"""Tests of all export formats."""

from __future__ import annotations

import pytest

from service.grading.exports import EXPORTS
from tests.service.grading.exports.samples import hostile
from tests.service.grading.exports.test_json_forms import RUNNER


@pytest.mark.parametrize("form", EXPORTS)
def test_no_character_changes_direction_or_moves_the_cursor(
    form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in RUNNER.items():
        monkeypatch.setenv(name, value)
    written = EXPORTS[form](hostile(), None).decode()
    assert {c for c in written if not c.isprintable()} <= {"\n", "\r"}
